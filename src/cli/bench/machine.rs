//! What a benchmark was measured on.

use serde_json::{Value, json};

use crate::graph::Runtime;

/// Device, processor and load.
pub(super) struct Machine {
    device: String,
    driver: String,
    kind: String,
    cores: usize,
    load: Option<f64>,
}

impl Machine {
    pub(super) fn of(runtime: &Runtime) -> Self {
        let info = runtime.device().info();
        // Linux only; elsewhere unknown.
        let load = std::fs::read_to_string("/proc/loadavg").ok();
        Self {
            device: info.name.clone(),
            driver: info.driver.clone(),
            kind: info.kind.to_string(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            load: load.and_then(|text| text.split_whitespace().next()?.parse().ok()),
        }
    }

    #[cfg(test)]
    pub(super) fn example() -> Self {
        Self { device: "d".into(), driver: "v".into(), kind: "software".into(), cores: 2, load: None }
    }

    /// The first lines of every table.
    pub(super) fn lines(&self) -> Vec<String> {
        let Self { device, driver, kind, cores, load } = self;
        let load = load.map_or(String::new(), |load| format!(", load average {load:.2}"));
        vec![
            format!("{device}, {kind}, driver {driver}"),
            format!("{cores} CPU threads{load}; nephroid {}", env!("CARGO_PKG_VERSION")),
        ]
    }

    /// The same as members of an object.
    pub(super) fn json(&self) -> serde_json::Map<String, Value> {
        let Self { device, driver, kind, cores, load } = self;
        let members = [
            ("version", json!(env!("CARGO_PKG_VERSION"))),
            ("device", json!(device)),
            ("driver", json!(driver)),
            ("kind", json!(kind)),
            ("cpu_threads", json!(cores)),
            ("load_average", json!(load)),
        ];
        members.map(|(name, value)| (name.to_owned(), value)).into_iter().collect()
    }
}
