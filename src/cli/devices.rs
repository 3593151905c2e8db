//! `nephroid devices`: the Vulkan devices and what each lacks.

use clap::Args;
use serde_json::{Value, json};

use super::console::print;
use super::numbers::bytes;
use crate::error::{Error, Result};
use crate::vk::{self, DeviceInfo};

const EXAMPLES: &str = "\
Examples:
  nephroid devices
  nephroid render cup.glb -o cup.png --device 1
  nephroid render cup.glb -o cup.png --device cpu";

/// Flags of `nephroid devices`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DevicesArgs {
    /// Print JSON instead of text
    #[arg(long)]
    json: bool,
}

/// Lists index, name, kind and driver of every device, and what it lacks for nephroid.
///
/// # Errors
/// [`Error::NoDevice`] if there is no Vulkan loader, no driver or no device.
pub fn run(args: &DevicesArgs) -> Result<()> {
    let devices = vk::devices()?;
    if devices.is_empty() {
        let advice = "the Vulkan loader works, but no driver offers a device (on Debian: mesa-vulkan-drivers)";
        return Err(Error::NoDevice(advice.into()));
    }
    print(&if args.json { format!("{:#}", as_json(&devices)) } else { as_text(&devices) })
}

/// Index of the device that is used without `--device`, if any is usable.
fn default_index(devices: &[DeviceInfo]) -> Option<usize> {
    devices.iter().min_by_key(|device| device.rank()).filter(|d| d.obstacles().is_empty()).map(|d| d.index)
}

fn as_text(devices: &[DeviceInfo]) -> String {
    let default = default_index(devices);
    let mut lines: Vec<String> = devices.iter().map(|device| describe(device, default)).collect();
    if default.is_none() {
        lines.push("none of them is usable: a newer driver may be (on Debian: mesa-vulkan-drivers)".into());
    }
    lines.join("\n")
}

fn describe(device: &DeviceInfo, default: Option<usize>) -> String {
    let (major, minor, patch) = device.api_version;
    let chosen = if default == Some(device.index) { ", chosen by default" } else { "" };
    let limits = &device.limits;
    let mut lines = vec![
        format!("{}  {}", device.index, device.name),
        format!("   {}{chosen}, Vulkan {major}.{minor}.{patch}, driver {}", device.kind, device.driver),
        format!(
            "   memory {}, one buffer {}, seen by a kernel {}, subgroups of {}",
            bytes(limits.heap),
            bytes(limits.allocation),
            bytes(limits.storage_range),
            limits.subgroup_size,
        ),
    ];
    lines.extend(device.obstacles().iter().map(|what| format!("   not usable: lacks {what}")));
    lines.extend(device.lacks[device.blocking..].iter().map(|what| format!("   does without: {what}")));
    lines.join("\n")
}

fn as_json(devices: &[DeviceInfo]) -> Value {
    let default = default_index(devices);
    let entry = |device: &DeviceInfo| {
        let (major, minor, patch) = device.api_version;
        json!({
            "index": device.index, "name": device.name, "kind": device.kind.to_string(), "driver": device.driver,
            "vulkan": format!("{major}.{minor}.{patch}"),
            "default": default == Some(device.index), "usable": device.obstacles().is_empty(),
            "obstacles": device.obstacles(), "lacks": device.lacks[device.blocking..],
            "bytes": {
                "memory": device.limits.heap, "buffer": device.limits.allocation,
                "binding": device.limits.storage_range,
            },
            "subgroup_size": device.limits.subgroup_size,
        })
    };
    devices.iter().map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::{DeviceKind, Features, Limits};

    fn device(index: usize, kind: DeviceKind, lacks: &[&str], blocking: usize) -> DeviceInfo {
        let limits = Limits { heap: 3 << 30, ..Limits::of_a_processor() };
        DeviceInfo {
            index,
            name: format!("device {index}"),
            kind,
            driver: "some 1.2".into(),
            api_version: (1, 3, 7),
            limits,
            features: Features::default(),
            lacks: lacks.iter().map(|&text| text.to_owned()).collect(),
            blocking,
        }
    }

    #[test]
    fn the_default_is_the_best_usable_device() {
        use DeviceKind::{Discrete, Integrated, Software};
        let old = device(1, Discrete, &["timeline semaphores", "timestamps"], 1);
        let machine = [device(0, Software, &[], 0), old.clone(), device(2, Integrated, &["timestamps"], 0)];
        assert_eq!(default_index(&machine), Some(2));
        let text = as_text(&machine);
        assert_eq!(text.matches("chosen by default").count(), 1);
        assert!(
            text.contains("2  device 2\n   integrated, chosen by default, Vulkan 1.3.7, driver some 1.2"),
            "{text}"
        );
        assert!(text.contains("not usable: lacks timeline semaphores\n   does without: timestamps"), "{text}");
        assert!(text.contains("memory 3 GiB, one buffer 2 GiB, seen by a kernel 128 MiB"), "{text}");
        let value = as_json(&machine);
        assert_eq!((&value[1]["usable"], &value[2]["default"]), (&false.into(), &true.into()));
        assert_eq!(default_index(std::slice::from_ref(&old)), None);
        assert!(as_text(&[old]).ends_with("(on Debian: mesa-vulkan-drivers)"));
    }
}
