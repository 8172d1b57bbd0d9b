#![expect(unsafe_code, reason = "wgpu has no safe way to leave out window systems")]

use ash::khr::{wayland_surface, xcb_surface, xlib_surface};
use wgpu::hal::api::Vulkan;
use wgpu::{Adapter, Backends, Instance, InstanceFlags};

/// Returns every Vulkan adapter, including software adapters. No window-system extension is
/// requested: with one, Mesa's layers look for a desktop session and print warnings where there is
/// none.
pub(crate) fn adapters() -> Vec<Adapter> {
    let descriptor = wgpu::hal::InstanceDescriptor {
        name: "sensor-render",
        flags: InstanceFlags::empty(),
        memory_budget_thresholds: Default::default(),
        backend_options: Default::default(),
        telemetry: None,
        display: None,
    };
    let window_systems = [wayland_surface::NAME, xcb_surface::NAME, xlib_surface::NAME];
    // SAFETY: the removed extensions serve windows only, and no window is ever created; everything
    // else is as the backend requests it.
    let instance = unsafe {
        wgpu::hal::vulkan::Instance::init_with_callback(
            &descriptor,
            Some(Box::new(|arguments| {
                arguments.extensions.retain(|name| !window_systems.contains(name));
            })),
        )
    };
    // Without a Vulkan loader there is no adapter.
    let Ok(instance) = instance else { return Vec::new() };
    // SAFETY: the instance was created above and ownership is passed on.
    let instance = unsafe { Instance::from_hal::<Vulkan>(instance) };
    pollster::block_on(instance.enumerate_adapters(Backends::VULKAN))
}
