//! What settings have to be.

use super::{Method, Sampling, Settings};
use crate::error::{Error, Result};

impl Settings {
    /// Checks that the method can render with these settings.
    ///
    /// # Errors
    /// [`Error::Usage`] if it has no such model.
    pub(in crate::render) fn check_method(&self) -> Result<()> {
        let traits = self.method.traits();
        if self.blinn_phong && !traits.takes_blinn_phong {
            return Err(Error::Usage("method path scatters by GGX: it has no Blinn-Phong model".into()));
        }
        if self.lens.is_some() && !traits.takes_lens {
            let text = "--method light connects light to a pinhole or a parallel camera: leave --aperture out, or choose another method";
            return Err(Error::Usage(text.into()));
        }
        if self.sampling != Sampling::Full && self.method == Method::Light {
            let text = "--method light estimates no density: leave --sampling out, or choose another method";
            return Err(Error::Usage(text.into()));
        }
        Ok(())
    }
}
