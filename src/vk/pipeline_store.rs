//! The pipelines of a device: each is made once per kernel and constants, and remembered in memory and, where the
//! driver uses it, on disk.

use super::cache::CacheFile;
use super::call::{failed, lock};
use super::core::Core;
use super::pipeline::{Key, Pipeline, PipelineDesc};
use super::raster_pipeline::RasterDesc;
use crate::error::Result;
use ash::vk;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// The pipelines of a device and the driver's cache behind them.
pub(super) struct PipelineStore {
    core: Arc<Core>,
    made: Mutex<HashMap<Key, Arc<Pipeline>>>,
    cache: vk::PipelineCache,
    file: Option<CacheFile>,
    /// What the cache held when it was loaded; an unchanged one is not written again.
    loaded: Vec<u8>,
}

impl PipelineStore {
    pub fn new(core: Arc<Core>, file: Option<CacheFile>) -> Result<Self> {
        let loaded = file.as_ref().map(CacheFile::load).unwrap_or_default();
        let create = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the data was given by vkGetPipelineCacheData of this device and driver, unchanged since: identity
            // and checksum were compared (VUID-VkPipelineCacheCreateInfo-initialDataSize-00769).
            unsafe { core.raw.create_pipeline_cache(&info, None) }
        };
        let cache = create(&loaded).or_else(|_| create(&[])).map_err(failed("vkCreatePipelineCache", "pipelines"))?;
        Ok(Self { core, made: Mutex::default(), cache, file, loaded })
    }

    pub fn get(&self, desc: &PipelineDesc<'_>) -> Result<Arc<Pipeline>> {
        self.remember(Key::new(desc), |cache| Pipeline::new(&self.core, desc, cache))
    }

    /// The pipeline of a draw.
    pub fn get_raster(&self, desc: &RasterDesc<'_>) -> Result<Arc<Pipeline>> {
        self.remember(desc.key(), |cache| Pipeline::new_raster(&self.core, desc, cache))
    }

    fn remember(&self, key: Key, make: impl FnOnce(vk::PipelineCache) -> Result<Pipeline>) -> Result<Arc<Pipeline>> {
        // The lock is held while compiling, so that two threads never compile the same kernel.
        let mut made = lock(&self.made);
        if let Some(pipeline) = made.get(&key) {
            return Ok(Arc::clone(pipeline));
        }
        let pipeline = Arc::new(make(self.cache)?);
        made.insert(key, Arc::clone(&pipeline));
        Ok(pipeline)
    }
}

impl Drop for PipelineStore {
    fn drop(&mut self) {
        if let Some(file) = &self.file {
            // SAFETY: the cache belongs to this device and no other thread uses it: `self` is being dropped.
            let data = unsafe { self.core.raw.get_pipeline_cache_data(self.cache) }.unwrap_or_default();
            if !data.is_empty() && data != self.loaded {
                file.store(&data);
            }
        }
        // SAFETY: as above; pipelines do not need the cache they were made with.
        unsafe { self.core.raw.destroy_pipeline_cache(self.cache, None) };
    }
}
