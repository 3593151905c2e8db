//! The Vulkan loader, the instance, the validation layers and their messages.

use super::call::{failed, lock};
use crate::error::{Error, Result};
use ash::{ext, vk};
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, OnceLock};

/// The newest version whose features are used where present.
pub(super) const NEWEST: u32 = vk::API_VERSION_1_3;

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What the validation layers said so far: warnings and errors about our use of Vulkan.
///
/// A clone shares the list and outlives the device, so that messages from tear-down can be read as well.
#[derive(Clone, Debug, Default)]
pub struct ValidationLog(Arc<Mutex<Vec<String>>>);

impl ValidationLog {
    /// All messages so far.
    pub fn messages(&self) -> Vec<String> {
        lock(&self.0).clone()
    }

    /// [`Error::Validation`] with all messages, if there are any.
    pub fn check(&self) -> Result<()> {
        let messages = self.messages();
        if messages.is_empty() { Ok(()) } else { Err(Error::Validation(messages)) }
    }
}

/// An instance with an optional messenger; destroyed on drop.
pub(super) struct Instance {
    pub raw: ash::Instance,
    /// The highest version both loader and we speak; 1.2 or 1.3.
    pub version: u32,
    /// Whether debug names and labels can be used.
    pub debug_utils: bool,
    pub validating: bool,
    pub log: ValidationLog,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
}

/// The loader's library stays loaded: unloading drivers while other threads hold instances is a known source of
/// crashes.
pub(super) fn entry() -> Result<&'static ash::Entry> {
    static ENTRY: OnceLock<std::result::Result<ash::Entry, String>> = OnceLock::new();
    // SAFETY: loading runs the initialisers of the system's own Vulkan loader, which has no preconditions; the
    // library is never unloaded, so its function pointers stay valid.
    let entry = ENTRY.get_or_init(|| unsafe { ash::Entry::load() }.map_err(|cause| cause.to_string()));
    entry.as_ref().map_err(|cause| {
        Error::NoDevice(format!("the Vulkan loader cannot be loaded ({cause}); on Debian install libvulkan1"))
    })
}

impl Instance {
    /// Creates an instance for at most Vulkan `newest`, with the validation layer if `validate`.
    pub fn new(validate: bool, newest: u32) -> Result<Self> {
        let entry = entry()?;
        let version = supported_version(entry)?.min(newest);
        let names = extension_names(entry, None)?;
        if validate {
            require_layer(entry)?;
        }
        let mut extensions = Vec::new();
        let debug_utils = names.iter().any(|name| name == ext::debug_utils::NAME);
        if debug_utils {
            extensions.push(ext::debug_utils::NAME.as_ptr());
        }
        let portability = names.iter().any(|name| name == ash::khr::portability_enumeration::NAME);
        if portability {
            extensions.push(ash::khr::portability_enumeration::NAME.as_ptr());
        }
        let layers = if validate { vec![VALIDATION_LAYER.as_ptr()] } else { Vec::new() };
        if validate
            && extension_names(entry, Some(VALIDATION_LAYER))?.iter().any(|n| n == ext::validation_features::NAME)
        {
            extensions.push(ext::validation_features::NAME.as_ptr());
        }
        let log = ValidationLog::default();
        let app = vk::ApplicationInfo::default().application_name(c"nephroid").api_version(version);
        let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
        let mut messages = messenger_info(&log);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&app)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        if portability {
            info = info.flags(vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR);
        }
        if validate {
            info = info.push_next(&mut features).push_next(&mut messages);
        }
        // SAFETY: the layers and extensions named are reported as present
        // (VUID-vkCreateInstance-ppEnabledExtensionNames-01388); all pointers in `info` outlive the call.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|code| {
            let hint = match code {
                vk::Result::ERROR_INCOMPATIBLE_DRIVER => {
                    "no Vulkan driver is installed; on Debian: mesa-vulkan-drivers"
                }
                _ => "the loader or a layer refuses",
            };
            Error::NoDevice(format!("{hint} (vkCreateInstance gives VkResult {})", code.as_raw()))
        })?;
        let mut instance = Self { raw, version, debug_utils, validating: validate, log, messenger: None };
        if validate {
            instance.listen(entry)?;
        }
        Ok(instance)
    }

    /// Collects messages from now on.
    fn listen(&mut self, entry: &ash::Entry) -> Result<()> {
        let debug = ext::debug_utils::Instance::new(entry, &self.raw);
        // SAFETY: VK_EXT_debug_utils is enabled (the layer provides it); the user pointer refers to the log's shared
        // state, of which `self` keeps a share until the messenger is destroyed.
        let messenger = unsafe { debug.create_debug_utils_messenger(&messenger_info(&self.log), None) }
            .map_err(failed("vkCreateDebugUtilsMessengerEXT", "messenger"))?;
        self.messenger = Some((debug, messenger));
        Ok(())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: every child of the instance is gone: devices own their instance and drop it last
        // (VUID-vkDestroyInstance-instance-00629). The log is still alive for messages sent during destruction.
        unsafe {
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn supported_version(entry: &ash::Entry) -> Result<u32> {
    // SAFETY: vkEnumerateInstanceVersion has no preconditions; a 1.0 loader without it is handled by ash.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .map_err(failed("vkEnumerateInstanceVersion", "loader"))?
        .unwrap_or(vk::API_VERSION_1_0);
    if version < vk::API_VERSION_1_2 {
        return Err(Error::NoDevice("the Vulkan loader is older than Vulkan 1.2".into()));
    }
    Ok(version)
}

fn extension_names(entry: &ash::Entry, layer: Option<&CStr>) -> Result<Vec<std::ffi::CString>> {
    // SAFETY: `layer`, where given, was reported as present (vkEnumerateInstanceExtensionProperties, pLayerName).
    let list = unsafe { entry.enumerate_instance_extension_properties(layer) }
        .map_err(failed("vkEnumerateInstanceExtensionProperties", "loader"))?;
    Ok(list.iter().filter_map(|e| e.extension_name_as_c_str().ok().map(CStr::to_owned)).collect())
}

fn require_layer(entry: &ash::Entry) -> Result<()> {
    // SAFETY: vkEnumerateInstanceLayerProperties has no preconditions.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .map_err(failed("vkEnumerateInstanceLayerProperties", "loader"))?;
    if layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER)) {
        return Ok(());
    }
    Err(Error::NoDevice(
        "validation was asked for, but VK_LAYER_KHRONOS_validation is not installed; \
         on Debian install vulkan-validationlayers"
            .into(),
    ))
}

fn messenger_info(log: &ValidationLog) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    // Only VALIDATION messages: GENERAL ones are the loader's remarks about other drivers, PERFORMANCE ones advice.
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
        .pfn_user_callback(Some(on_message))
        .user_data(Arc::as_ptr(&log.0).cast_mut().cast())
}

/// Appends one message to the log that `user` points to.
unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes valid callback data, and `user` as given in `messenger_info`, where the log outlives the
    // messenger; p_message is null or a NUL-terminated string (VkDebugUtilsMessengerCallbackDataEXT).
    unsafe {
        let text = data.as_ref().and_then(|data| (!data.p_message.is_null()).then(|| CStr::from_ptr(data.p_message)));
        if let (Some(text), Some(log)) = (text, user.cast::<Mutex<Vec<String>>>().as_ref()) {
            lock(log).push(text.to_string_lossy().into_owned());
        }
    }
    vk::FALSE
}
