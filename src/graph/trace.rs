//! Timings as a Chrome trace (load it in a trace viewer such as Perfetto).

use super::execute::Timing;

/// Chrome trace JSON of scope timings; one complete event per scope, times in microseconds.
pub fn chrome_trace(timings: &[Timing]) -> String {
    let events: Vec<_> = timings
        .iter()
        .map(|t| {
            serde_json::json!({
                "name": t.name, "ph": "X", "pid": 1, "tid": 1,
                "ts": t.start_ns as f64 / 1e3, "dur": t.end_ns.saturating_sub(t.start_ns) as f64 / 1e3,
            })
        })
        .collect();
    serde_json::json!({ "traceEvents": events, "displayTimeUnit": "ms" }).to_string()
}
