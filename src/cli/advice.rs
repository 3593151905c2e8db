//! What a user of the program can do about an error. The library names causes and settings; flags are known only here.

use crate::error::{Error, MemoryCause};
use crate::scene::frame::MAP_HELPS;

/// Settings by their fields, and the flags that set them.
pub(super) const FLAGS: &[(&str, &str)] = &[
    ("amplification", "--bounds-stage"),
    ("blinn_phong", "--bsdf"),
    ("bound_vertices", "--bounds-vertices"),
    ("camera", "--camera"),
    ("caustic_smoothing", "--caustic-smoothing"),
    ("estimator", "--estimator"),
    ("fold", "--no-fold"),
    ("footprint", "--footprint"),
    ("global_smoothing", "--global-smoothing"),
    ("height", "--size"),
    ("knn_photons", "--knn-photons"),
    ("largest_footprint", "--largest-footprint"),
    ("layers", "--aov"),
    ("lens", "--aperture"),
    ("method", "--method"),
    ("photon_build", "--photon-build"),
    ("photons", "--photons"),
    ("record", "--photon-record"),
    ("sampling", "--sampling"),
    ("tracer", "--tracer"),
    ("seed", "--seed"),
    ("select", "--device"),
    ("shutter", "--shutter-seconds"),
    ("tree_build", "--tree"),
    ("validate", "--validate"),
    ("weight", "--kernel"),
    ("width", "--size"),
];

/// The flag of a setting; settings without a flag keep their names.
fn flag(setting: &'static str) -> &'static str {
    FLAGS.iter().find(|(name, _)| *name == setting).map_or(setting, |(_, flag)| flag)
}

/// The flags of these settings, each once: `--size`, `--method and --aperture`.
fn flags(settings: &[&'static str], word: &str) -> String {
    let mut flags: Vec<&str> = settings.iter().map(|setting| flag(setting)).collect();
    flags.dedup();
    flags.join(&format!(" {word} "))
}

/// The sentence that the program prints: the error, with flags in place of settings, and what can be done.
pub(super) fn sentence(error: &Error) -> String {
    match error {
        Error::Setting { settings, cause } => format!("{}: {cause}", flags(settings, "and")),
        _ => match advice(error) {
            Some(advice) => format!("{error}; {advice}"),
            None => error.to_string(),
        },
    }
}

/// What can be done about an error, where flags or the scene can do something.
fn advice(error: &Error) -> Option<String> {
    match error {
        Error::MissingFeature { settings: ["amplification"], .. } => Some("use --bounds-stage vertex".into()),
        Error::MissingFeature { settings, .. } if !settings.is_empty() => {
            Some(format!("choose another {}", flags(settings, "or")))
        }
        Error::OutOfMemory { cause, .. } => memory_advice(cause),
        _ => None,
    }
}

/// A warning about a scene, with the flag that helps, if one does.
pub(super) fn warning(text: &str) -> String {
    if text.ends_with(MAP_HELPS) { format!("{text} (--environment FILE)") } else { text.to_owned() }
}

fn memory_advice(cause: &MemoryCause) -> Option<String> {
    match cause {
        MemoryCause::BufferTooLong { .. } | MemoryCause::DeviceFull { .. } | MemoryCause::BufferRefused(_) => {
            Some("lower --photons or --size, or choose another --device".into())
        }
        MemoryCause::ImageRefused(_) => Some("lower --size".into()),
        MemoryCause::BindingTooLong { .. } => {
            Some("lower --photons or --size, simplify the scene, or choose another --device".into())
        }
        MemoryCause::SceneTooLarge { part, .. } => Some(format!("reduce the scene's {part}")),
        MemoryCause::TooManyPhotons { .. } => Some("lower --photons".into()),
        MemoryCause::TooManyElements => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_become_flags() {
        let refused = |settings| sentence(&Error::setting(settings, "no"));
        assert_eq!(refused(&["width", "height"]), "--size: no");
        assert_eq!(refused(&["sampling", "estimator"]), "--sampling and --estimator: no");
        assert_eq!(refused(&["alpha"]), "alpha: no", "a setting without a flag");
        let lacking = |settings| {
            sentence(&Error::MissingFeature { device: "d".into(), feature: "geometry kernels".into(), settings })
        };
        assert_eq!(lacking(&["amplification"]), "device 'd' lacks geometry kernels; use --bounds-stage vertex");
        assert_eq!(lacking(&["estimator"]), "device 'd' lacks geometry kernels; choose another --estimator");
        assert_eq!(lacking(&[]), "device 'd' lacks geometry kernels");
    }

    #[test]
    fn memory_comes_with_what_can_be_lowered() {
        let told = |cause| sentence(&Error::OutOfMemory { object: "hits".into(), bytes: 9, cause });
        let start = "'hits' needs 9 bytes, more than this device gives: ";
        let binding = "a kernel sees at most 8 bytes of a buffer on this device; \
                       lower --photons or --size, simplify the scene, or choose another --device";
        assert_eq!(told(MemoryCause::BindingTooLong { longest: 8 }), format!("{start}{binding}"));
        let full = "what is left of the device's memory is 8 bytes; \
                    lower --photons or --size, or choose another --device";
        assert_eq!(told(MemoryCause::DeviceFull { left: 8 }), format!("{start}{full}"));
        let part = MemoryCause::SceneTooLarge { part: "textures".into(), longest: 8 };
        assert!(told(part).ends_with("; reduce the scene's textures"));
        assert!(told(MemoryCause::TooManyElements).ends_with(" 2^32 - 1 elements"));
    }

    #[test]
    fn dark_scenes_come_with_the_flag_for_light() {
        assert_eq!(warning("no light here"), "no light here");
        assert!(warning(MAP_HELPS).ends_with("--environment FILE)"));
    }

    #[test]
    fn what_has_no_advice_is_said_as_it_is() {
        let error = Error::scene("a.glb", "no meshes");
        assert_eq!(sentence(&error), error.to_string());
    }
}
