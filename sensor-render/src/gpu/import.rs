//! Import of memory of this process as a buffer of the device (VK_EXT_external_memory_host), so
//! that the device writes measurements directly into shared memory.
#![expect(unsafe_code, reason = "wgpu has no safe way to import host memory")]

use ash::ext::external_memory_host;
use ash::vk;
use wgpu::hal::api::Vulkan;
use wgpu::{Adapter, Buffer, BufferDescriptor, BufferUsages, DeviceDescriptor};

/// Alignment of addresses and lengths of imported memory; no driver requires more.
pub(crate) const ALIGNMENT: usize = 4096;

/// Opens the device with the extension; `None` if the adapter lacks it.
pub(crate) fn open(
    adapter: &Adapter,
    descriptor: &DeviceDescriptor,
) -> Option<(wgpu::Device, wgpu::Queue)> {
    // SAFETY: the handle is only used to open a device; nothing is destroyed through it.
    let hal = unsafe { adapter.as_hal::<Vulkan>() }?;
    if !hal.physical_device_capabilities().supports_extension(external_memory_host::NAME) {
        return None;
    }
    // SAFETY: the adapter supports the one extension that is added.
    let opened = unsafe {
        hal.open_with_callback(
            descriptor.required_features,
            &descriptor.required_limits,
            &descriptor.memory_hints,
            Some(Box::new(|arguments| arguments.extensions.push(external_memory_host::NAME))),
        )
    };
    // SAFETY: `opened` was opened from this adapter, with the descriptor's features and limits.
    unsafe { adapter.create_device_from_hal(opened.ok()?, descriptor) }.ok()
}

/// Imports `len` bytes from `address` on as a buffer that can be copied into and that shaders can write.
///
/// # Safety
/// These bytes must stay mapped, at the same physical pages, until the buffer is dropped and the
/// device is idle.
pub(crate) unsafe fn import(
    device: &wgpu::Device,
    address: *mut u8,
    len: usize,
) -> Result<Buffer, String> {
    if !address.addr().is_multiple_of(ALIGNMENT) || !len.is_multiple_of(ALIGNMENT) || len == 0 {
        return Err(format!("{len} bytes at {address:p} are not whole pages"));
    }
    let size = len as u64;
    let kind = vk::ExternalMemoryHandleTypeFlags::HOST_ALLOCATION_EXT;
    // SAFETY: the handles are only used below, while `device` lives; every object created is either
    // passed to wgpu, which destroys it, or destroyed here.
    unsafe {
        let hal = device.as_hal::<Vulkan>().ok_or("the device is not a Vulkan device")?;
        let (raw, instance) = (hal.raw_device(), hal.shared_instance().raw_instance());
        let extension = external_memory_host::Device::new(instance, raw);
        let mut pointer = vk::MemoryHostPointerPropertiesEXT::default();
        (extension.fp().get_memory_host_pointer_properties_ext)(
            raw.handle(),
            kind,
            address.cast(),
            &mut pointer,
        )
        .result()
        .map_err(|why| format!("the driver refuses this memory: {why}"))?;
        let mut external = vk::ExternalMemoryBufferCreateInfo::default().handle_types(kind);
        let info = vk::BufferCreateInfo::default()
            .size(size)
            .usage(vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::STORAGE_BUFFER)
            .push_next(&mut external);
        let buffer = raw.create_buffer(&info, None).map_err(|why| why.to_string())?;
        let memory = bind(&hal, buffer, pointer.memory_type_bits, address, size);
        let memory = memory.inspect_err(|_| raw.destroy_buffer(buffer, None))?;
        let managed = wgpu::hal::vulkan::Buffer::from_raw_managed(buffer, memory, 0, size);
        Ok(device.create_buffer_from_hal::<Vulkan>(
            managed,
            &BufferDescriptor {
                label: Some("imported"),
                size,
                usage: BufferUsages::COPY_DST | BufferUsages::STORAGE,
                mapped_at_creation: false,
            },
        ))
    }
}

/// Imports the memory and binds it to `buffer`.
///
/// # Safety
/// As [`import`].
unsafe fn bind(
    hal: &wgpu::hal::vulkan::Device,
    buffer: vk::Buffer,
    importable: u32,
    address: *mut u8,
    size: u64,
) -> Result<vk::DeviceMemory, String> {
    // SAFETY: guaranteed by the caller; `buffer` is a live buffer of this device.
    unsafe {
        let (device, instance) = (hal.raw_device(), hal.shared_instance().raw_instance());
        let needed = device.get_buffer_memory_requirements(buffer);
        if needed.size > size {
            return Err(format!("the driver needs {} bytes for {size}", needed.size));
        }
        let properties = instance.get_physical_device_memory_properties(hal.raw_physical_device());
        let usable = |index: &u32| needed.memory_type_bits & importable & (1 << index) != 0;
        let flags = |index: &u32| properties.memory_types[*index as usize].property_flags;
        // Coherent memory needs no flush after the device wrote it. Cached memory is fast to read.
        let coherent = |index: &u32| flags(index).contains(vk::MemoryPropertyFlags::HOST_COHERENT);
        let cached = |index: &u32| flags(index).contains(vk::MemoryPropertyFlags::HOST_CACHED);
        let types = || (0..properties.memory_type_count).filter(usable).filter(coherent);
        let index = types()
            .find(cached)
            .or_else(|| types().next())
            .ok_or("no coherent memory type takes this memory")?;
        let mut imported = vk::ImportMemoryHostPointerInfoEXT::default()
            .handle_type(vk::ExternalMemoryHandleTypeFlags::HOST_ALLOCATION_EXT)
            .host_pointer(address.cast());
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(size)
            .memory_type_index(index)
            .push_next(&mut imported);
        let memory = device.allocate_memory(&info, None).map_err(|why| why.to_string())?;
        match device.bind_buffer_memory(buffer, memory, 0) {
            Ok(()) => Ok(memory),
            Err(why) => {
                device.free_memory(memory, None);
                Err(why.to_string())
            }
        }
    }
}
