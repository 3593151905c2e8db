//! Numbers as people read them.

/// Three digits and a decimal prefix: `4.12 M`, `850`.
pub fn si(number: f64) -> String {
    let (scale, prefix) = match number {
        n if n >= 999.5e6 => (1e9, " G"),
        n if n >= 999.5e3 => (1e6, " M"),
        n if n >= 999.5 => (1e3, " k"),
        _ => (1.0, ""),
    };
    let scaled = number / scale;
    let decimals = if scaled < 9.995 {
        2
    } else if scaled < 99.95 {
        1
    } else {
        0
    };
    format!("{scaled:.decimals$}{prefix}")
}

/// Seconds as `42 s`, `3:07` or `2:03:07`.
pub fn clock(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m}:{s:02}"),
        (h, m, s) => format!("{h}:{m:02}:{s:02}"),
    }
}

/// A number of bytes for people: `1.5 MiB`.
pub fn bytes(count: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    // Below 1000 of a unit, so that three digits are always enough.
    let power = (0..UNITS.len()).find(|p| count as f64 / 1024f64.powi(*p as i32) < 999.5).unwrap_or(UNITS.len() - 1);
    let scaled = count as f64 / 1024f64.powi(power as i32);
    let digits = if power == 0 || scaled >= 99.95 || scaled.fract() == 0.0 { 0 } else { 1 };
    format!("{scaled:.digits$} {}", UNITS[power])
}

/// Two digits: `1.3 %`, `0.021 %`, `120 %`.
pub fn percent(fraction: f64) -> String {
    let hundredths = 100.0 * fraction;
    let digits = if hundredths > 0.0 { (1.0 - hundredths.log10().floor()).clamp(0.0, 9.0) as usize } else { 1 };
    format!("{hundredths:.digits$} %")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        for (number, text) in [(0.0, "0.00"), (9.994, "9.99"), (99.94, "99.9"), (999.4, "999"), (999.6, "1.00 k")] {
            assert_eq!(si(number), text);
        }
        assert_eq!(si(4.123e6), "4.12 M");
        assert_eq!(si(1.5e12), "1500 G");
    }

    #[test]
    fn times_read_like_a_clock() {
        assert_eq!([clock(0.4), clock(59.6), clock(187.0), clock(7387.0)], ["0 s", "1:00", "3:07", "2:03:07"]);
    }

    #[test]
    fn byte_counts() {
        for (count, text) in [(0, "0 B"), (999, "999 B"), (1023, "1.0 KiB"), (1536, "1.5 KiB"), (1 << 27, "128 MiB")] {
            assert_eq!(bytes(count), text);
        }
        assert_eq!(bytes(1000 << 20), "1.0 GiB");
        assert_eq!(bytes(u64::MAX), "16777216 TiB");
    }

    #[test]
    fn percentages_keep_two_digits() {
        assert_eq!([0.013, 0.000_21, 1.2, 0.0, 0.1].map(percent), ["1.3 %", "0.021 %", "120 %", "0.0 %", "10 %"]);
    }
}
