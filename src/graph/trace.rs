//! Timings, and timings as a Chrome trace (load it in a trace viewer such as Perfetto).

/// Time of one scope of the last run.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// Scope name.
    pub name: String,
    /// Nesting depth, 0 outermost.
    pub depth: u32,
    /// Start in nanoseconds on the device's clock.
    pub start_ns: u64,
    /// End in nanoseconds.
    pub end_ns: u64,
}

/// Chrome trace JSON of scope timings, of one run or of several on one device; one complete event per scope, times in
/// microseconds from the first start on (a device's clock may have more digits than a JSON number keeps).
pub fn chrome_trace(timings: &[Timing]) -> String {
    let origin = timings.iter().map(|t| t.start_ns).min().unwrap_or(0);
    let events: Vec<_> = timings
        .iter()
        .map(|t| {
            serde_json::json!({
                "name": t.name, "ph": "X", "pid": 1, "tid": 1,
                "ts": (t.start_ns - origin) as f64 / 1e3, "dur": t.end_ns.saturating_sub(t.start_ns) as f64 / 1e3,
            })
        })
        .collect();
    serde_json::json!({ "traceEvents": events, "displayTimeUnit": "ms" }).to_string()
}
