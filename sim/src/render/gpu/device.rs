//! Selection and opening of the GPU.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use wgpu::{
    Adapter, Backends, Device, DeviceDescriptor, DeviceType, Instance, InstanceDescriptor, Limits, PollType,
    Queue,
};

use super::passes::Passes;

/// Maximum time for an image, after which the device counts as hung.
const PATIENCE: Duration = Duration::from_secs(20);

/// Error of drawing on a GPU.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GpuError {
    #[error("there is no graphics processor with a Vulkan, Metal or Direct3D 12 driver")]
    Missing,
    #[error("{name} cannot be used: {reason}")]
    Unusable { name: String, reason: String },
    #[error("{name} draws other pictures than the embedded renderer")]
    Wrong { name: String },
    #[error("a picture of {width} x {height} pixels is too large for {name}")]
    TooLarge { name: String, width: u32, height: u32 },
}

/// An open device.
pub(super) struct Gpu {
    pub name: String,
    pub device: Device,
    pub queue: Queue,
    pub passes: Passes,
    /// The first fault since the last query.
    fault: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Opens the best adapter; software is the last choice.
    pub(super) fn open() -> Result<Gpu, GpuError> {
        let adapter = best().ok_or(GpuError::Missing)?;
        let name = name(&adapter);
        let unusable = |reason: String| GpuError::Unusable { name: name.clone(), reason };
        let descriptor = DeviceDescriptor {
            required_limits: Limits::default().using_resolution(adapter.limits()),
            ..DeviceDescriptor::default()
        };
        let opened = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = opened.map_err(|error| unusable(error.to_string()))?;
        let fault = Arc::new(Mutex::new(None));
        let first = fault.clone();
        // Without a handler, an error ends the process.
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            first.lock().expect("no holder panics").get_or_insert(error.to_string());
        }));
        let passes = Passes::new(&device);
        let gpu = Gpu { name: name.clone(), device, queue, passes, fault };
        gpu.settle()?;
        Ok(gpu)
    }

    /// Waits until all submitted work is done.
    pub(super) fn settle(&self) -> Result<(), GpuError> {
        let waited = self.device.poll(PollType::Wait { submission_index: None, timeout: Some(PATIENCE) });
        let fault = self.fault.lock().expect("no holder panics").take();
        match (waited, fault) {
            (Ok(_), None) => Ok(()),
            (_, Some(reason)) => Err(self.unusable(reason)),
            (Err(error), None) => Err(self.unusable(error.to_string())),
        }
    }

    pub(super) fn unusable(&self, reason: String) -> GpuError {
        GpuError::Unusable { name: self.name.clone(), reason }
    }
}

/// Returns true if there is a hardware GPU, not only software in its place.
pub(super) fn is_real() -> bool {
    best().is_some_and(|adapter| rank(&adapter) >= REAL)
}

/// Minimum rank of a hardware adapter.
const REAL: u32 = 2;

fn best() -> Option<Adapter> {
    let instance = Instance::new(InstanceDescriptor::new_without_display_handle());
    pollster::block_on(instance.enumerate_adapters(Backends::PRIMARY)).into_iter().max_by_key(rank)
}

fn rank(adapter: &Adapter) -> u32 {
    match adapter.get_info().device_type {
        DeviceType::Cpu => 0,
        DeviceType::Other => 1,
        DeviceType::VirtualGpu => REAL,
        DeviceType::IntegratedGpu => 3,
        DeviceType::DiscreteGpu => 4,
    }
}

/// Returns a name, for example `llvmpipe (LLVM 15.0.6, 256 bits) (Vulkan)`.
fn name(adapter: &Adapter) -> String {
    let info = adapter.get_info();
    format!("{} ({:?})", info.name, info.backend)
}
