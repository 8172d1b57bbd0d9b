// Where measurements are written: buffer 0 is the device's own, the others are imported payloads.
enable wgpu_binding_array;

struct Words {
    words: array<u32>,
}

// Twin of OUTPUTS_MAX in kernels.rs.
@group(1) @binding(0) var<storage, read_write> outputs: binding_array<Words, 256>;

fn put(number: u32, at: u32, word: u32) {
    outputs[number].words[at] = word;
}

// The buffer that a workgroup writes to. Stores of neighbouring threads are combined only where the index of the
// buffer is the same for all of them by its declaration, which matters in kernels that do little else; in those
// that trace, memory of workgroups takes 3 % from the cache of the nodes.
var<workgroup> output_number: u32;

// Precedes a barrier, and that every call of `put_chosen`.
fn choose_output(number: u32) {
    output_number = number;
}

fn put_chosen(at: u32, word: u32) {
    outputs[output_number].words[at] = word;
}
