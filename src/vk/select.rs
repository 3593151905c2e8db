//! Which device is opened.

use super::limits::{Candidate, DeviceInfo, DeviceKind};
use crate::error::{Error, Result};
use std::str::FromStr;

/// Which device to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceSelect {
    /// The best kind that works: discrete, integrated, virtual, software.
    #[default]
    Auto,
    /// By position in [`super::devices`].
    Index(usize),
    /// The best kind among those whose name contains this, ignoring case.
    Name(String),
    /// A software renderer.
    Cpu,
}

impl FromStr for DeviceSelect {
    type Err = Error;

    /// `auto`, `cpu`, a number, or part of a name.
    fn from_str(text: &str) -> Result<Self> {
        let text = text.trim();
        let wrong = |cause| Error::Setting { settings: &["select"], cause };
        match text.to_ascii_lowercase().as_str() {
            "" => Err(wrong("expected a number, a part of a name, 'cpu' or 'auto'".into())),
            "auto" => Ok(Self::Auto),
            "cpu" => Ok(Self::Cpu),
            _ if text.bytes().all(|c| c.is_ascii_digit()) => {
                text.parse().map(Self::Index).map_err(|_| wrong(format!("there is no device {text}")))
            }
            _ => Ok(Self::Name(text.to_owned())),
        }
    }
}

impl DeviceSelect {
    /// Whether `info` fits, apart from what it can do.
    fn fits(&self, info: &DeviceInfo) -> bool {
        match self {
            Self::Auto => true,
            Self::Index(index) => info.index == *index,
            Self::Name(part) => info.name.to_lowercase().contains(&part.to_lowercase()),
            Self::Cpu => info.kind == DeviceKind::Software,
        }
    }

    /// The best of `candidates` that fits and is usable; ties go to the loader's order.
    pub(super) fn choose(&self, candidates: Vec<Candidate>) -> Result<Candidate> {
        let listed = list(&candidates);
        let mut fitting: Vec<Candidate> = candidates.into_iter().filter(|c| self.fits(&c.info)).collect();
        if fitting.is_empty() {
            return Err(Error::NoDevice(format!("{} among: {listed}", self.complaint())));
        }
        fitting.sort_by_key(|candidate| candidate.info.rank());
        let best = fitting.swap_remove(0);
        if best.info.blocking == 0 {
            return Ok(best);
        }
        let (device, feature) = (best.info.name.clone(), best.info.obstacles().join(", "));
        Err(Error::MissingFeature { device, feature, settings: &[] })
    }

    fn complaint(&self) -> String {
        match self {
            Self::Auto => "there is none".to_owned(),
            Self::Index(index) => format!("there is no device {index}"),
            Self::Name(part) => format!("no name contains '{part}'"),
            Self::Cpu => "there is no software device (on Debian: mesa-vulkan-drivers)".to_owned(),
        }
    }
}

fn list(candidates: &[Candidate]) -> String {
    if candidates.is_empty() {
        return "nothing (no Vulkan driver is installed; on Debian: mesa-vulkan-drivers)".to_owned();
    }
    let names: Vec<String> = candidates.iter().map(|c| format!("{} '{}'", c.info.index, c.info.name)).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::features::{Extensions, Features};
    use crate::vk::limits::{Identity, Limits};

    fn candidate(index: usize, name: &str, kind: DeviceKind, lacks: &[&str]) -> Candidate {
        let info = DeviceInfo {
            index,
            name: name.into(),
            kind,
            driver: String::new(),
            api_version: (1, 3, 0),
            limits: Limits::of_a_processor(),
            features: Features::default(),
            lacks: lacks.iter().map(|&text| text.to_owned()).collect(),
            blocking: lacks.len(),
        };
        let identity = Identity { vendor: 0, device: 0, driver_version: 0, uuid: [0; 16] };
        Candidate {
            raw: ash::vk::PhysicalDevice::null(),
            info,
            version: ash::vk::API_VERSION_1_3,
            extensions: Extensions::default(),
            queue_family: Some(0),
            identity,
        }
    }

    fn machine() -> Vec<Candidate> {
        vec![
            candidate(0, "llvmpipe (LLVM 15)", DeviceKind::Software, &[]),
            candidate(1, "Iris Xe", DeviceKind::Integrated, &[]),
            candidate(2, "GeForce old", DeviceKind::Discrete, &["timeline semaphores"]),
            candidate(3, "GeForce new", DeviceKind::Discrete, &[]),
        ]
    }

    fn chosen(text: &str) -> Result<usize> {
        text.parse::<DeviceSelect>()?.choose(machine()).map(|c| c.info.index)
    }

    #[test]
    fn the_best_usable_device_is_chosen() {
        assert_eq!(chosen("auto").unwrap(), 3);
        assert_eq!(chosen("cpu").unwrap(), 0);
        assert_eq!(chosen("1").unwrap(), 1);
        assert_eq!(chosen("geforce").unwrap(), 3);
        assert_eq!(chosen("IRIS").unwrap(), 1);
    }

    #[test]
    fn what_cannot_be_had_is_an_error_that_says_why() {
        assert!(matches!(chosen("2"), Err(Error::MissingFeature { feature, .. }) if feature.contains("timeline")));
        assert!(
            matches!(chosen("7"), Err(Error::NoDevice(what)) if what.contains("no device 7") && what.contains("Iris"))
        );
        assert!(matches!(chosen("voodoo"), Err(Error::NoDevice(what)) if what.contains("voodoo")));
        assert!(matches!(chosen(" "), Err(Error::Setting { .. })));
        assert!(matches!(chosen("99999999999999999999999"), Err(Error::Setting { .. })));
        let none = DeviceSelect::Auto.choose(Vec::new()).map(|c| c.info.index);
        assert!(matches!(none, Err(Error::NoDevice(what)) if what.contains("no Vulkan driver")));
    }
}
