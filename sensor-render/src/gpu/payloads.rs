use std::collections::BTreeMap;

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, Buffer,
    BufferUsages, CommandEncoder, Device, PollType,
};

use super::batch::{Batch, Target};
use super::import;
use super::kernels::{OUTPUTS_MAX, has_array};
use super::open::Gpu;
use super::resources::GrowableBuffer;

/// Buffers that measurements are written to: the device's own, and payloads in the memory of subscribers.
#[derive(Debug)]
pub(crate) struct Payloads {
    own: GrowableBuffer,
    /// By address; `None` while imports are not allowed.
    imported: Option<BTreeMap<usize, Import>>,
    /// Imported payloads that shaders write into, by number - 1.
    numbered: Vec<Buffer>,
    group: Option<BindGroup>,
    /// Hash of what was written to the device's own buffer last; if it changes, gaps between planes are cleared.
    layout_hash: u64,
}

/// Result of importing one payload.
#[derive(Debug)]
struct Import {
    len: usize,
    /// `None` if the driver refused the import.
    buffer: Option<Buffer>,
    number: Option<u32>,
}

impl Payloads {
    pub(crate) fn new(device: &Device) -> Payloads {
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        Payloads {
            own: GrowableBuffer::new(device, usage),
            imported: None,
            numbered: Vec::new(),
            group: None,
            layout_hash: 0,
        }
    }

    /// Allows imports.
    pub(crate) fn allow_imports(&mut self) {
        self.imported.get_or_insert_default();
    }

    /// Releases all imported memory, and allows no more imports.
    pub(crate) fn forget_imports(&mut self, device: &Device) {
        if self.imported.take().is_some() {
            self.numbered.clear();
            self.group = None;
            // The device frees the buffers when it is polled.
            let _ = device.poll(PollType::Poll);
        }
    }

    /// Returns the number of imported payloads.
    pub(crate) fn imported_count(&self) -> usize {
        let imported = self.imported.iter().flat_map(BTreeMap::values);
        imported.filter(|import| import.buffer.is_some()).count()
    }

    /// Returns the device's own buffer.
    pub(crate) fn own(&self) -> &Buffer {
        &self.own.buffer
    }

    /// Imports a payload, if imports are allowed and it is not imported yet; returns it if shaders can write
    /// into it.
    pub(crate) fn target(&mut self, device: &Device, out: &mut [u8]) -> Option<Target> {
        let import = self.import(device, out)?;
        let (number, buffer) = (import.number?, import.buffer.as_ref()?);
        Some(Target { number, byte_len: buffer.size() })
    }

    /// Returns the buffer of an imported payload.
    pub(crate) fn imported(&mut self, device: &Device, out: &mut [u8]) -> Option<&Buffer> {
        self.import(device, out)?.buffer.as_ref()
    }

    fn import(&mut self, device: &Device, out: &mut [u8]) -> Option<&Import> {
        let imported = self.imported.as_mut()?;
        let len = out.len() - out.len() % import::ALIGNMENT;
        let address = out.as_ptr().addr();
        if !address.is_multiple_of(import::ALIGNMENT) || len == 0 {
            return None;
        }
        let known = imported.get(&address);
        if known.is_none_or(|known| known.len < len) {
            let known = known.and_then(|known| known.number);
            #[expect(unsafe_code, reason = "import_payloads' caller has promised what it takes")]
            // SAFETY: the caller of `import_payloads` promised that payloads stay mapped.
            let buffer = unsafe { import::import(device, out.as_mut_ptr(), len) }.ok();
            let number = match &buffer {
                Some(buffer) => self.number(device, buffer, known),
                None => None,
            };
            self.imported.as_mut()?.insert(address, Import { len, buffer, number });
        }
        self.imported.as_ref()?.get(&address)
    }

    /// Gives a payload a number in the shaders, that of the one before at the same address if it had one;
    /// `None` if they cannot write into it.
    fn number(&mut self, device: &Device, buffer: &Buffer, known: Option<u32>) -> Option<u32> {
        let is_bindable = buffer.size() <= device.limits().max_storage_buffer_binding_size;
        let number = known.map_or(self.numbered.len() + 1, |known| known as usize);
        if !is_bindable || !has_array(device) || number >= OUTPUTS_MAX {
            return None;
        }
        match self.numbered.get_mut(number - 1) {
            Some(before) => *before = buffer.clone(),
            None => self.numbered.push(buffer.clone()),
        }
        self.group = None;
        Some(number as u32)
    }

    /// Returns the words of the buffer with a number.
    pub(crate) fn word_count(&self, number: u32) -> u64 {
        let buffer = match number.checked_sub(1) {
            Some(at) => self.numbered.get(at as usize),
            None => Some(&self.own.buffer),
        };
        buffer.map_or(0, |buffer| buffer.size() / 4)
    }

    /// Makes room for the measurements of a batch in the device's own buffer, and clears it if stale bytes may
    /// lie between the planes.
    pub(crate) fn prepare(&mut self, gpu: &Gpu, batch: &Batch, encoder: &mut CommandEncoder) {
        if batch.byte_len == 0 {
            return;
        }
        let bytes_max = gpu.device.limits().max_storage_buffer_binding_size;
        if self.own.grow(&gpu.device, batch.byte_len, bytes_max) {
            (self.group, self.layout_hash) = (None, 0);
        }
        let hash = batch.layout_hash();
        if std::mem::replace(&mut self.layout_hash, hash) != hash {
            encoder.clear_buffer(&self.own.buffer, 0, None);
        }
    }

    /// Returns the bind group of all buffers.
    pub(crate) fn group(&mut self, device: &Device, layout: &BindGroupLayout) -> &BindGroup {
        let Payloads { own, numbered, group, .. } = self;
        group.get_or_insert_with(|| {
            let own = own.buffer.as_entire_buffer_binding();
            let others = numbered.iter().map(Buffer::as_entire_buffer_binding);
            let all: Vec<_> = std::iter::once(own.clone()).chain(others).collect();
            let resource = if has_array(device) {
                BindingResource::BufferArray(&all)
            } else {
                BindingResource::Buffer(own)
            };
            device.create_bind_group(&BindGroupDescriptor {
                label: Some("outputs"),
                layout,
                entries: &[BindGroupEntry { binding: 0, resource }],
            })
        })
    }
}
