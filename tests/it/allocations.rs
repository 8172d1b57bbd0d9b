//! A count of heap allocations by thread, and what an agent's control loop may allocate.
#![expect(unsafe_code, reason = "a global allocator that counts forwards to the system's")]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    hint::black_box,
};

use client_lib::{ActorId, CameraOutputs, Client, Pose, Spawn, VehicleControl, wire::camera};
use glam::{Quat, Vec3};

use crate::kit::Sim;

struct CountingAllocator;

thread_local! {
    /// Allocations of this thread so far.
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

fn count_one() {
    // A thread that ends allocates after its counter is gone.
    let _ = COUNT.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call is forwarded unchanged to the system's allocator; counting does not allocate,
// because the counter is a constant and needs no destructor.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count_one();
        // SAFETY: the caller's promises are those that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count_one();
        // SAFETY: as in `alloc`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count_one();
        // SAFETY: as in `alloc`; the pointer came from the same allocator.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as in `realloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Returns how often `work` allocates on this thread.
fn allocations_of(work: impl FnOnce()) -> u64 {
    let before = COUNT.get();
    work();
    COUNT.get() - before
}

#[test]
fn a_vector_is_counted_as_one_allocation() {
    assert_eq!(allocations_of(|| drop(black_box(vec![7u8; 100]))), 1);
    let on_stack = || {
        black_box([7u8; 100]);
    };
    assert_eq!(allocations_of(on_stack), 0);
}

#[test]
fn the_control_loop_of_an_agent_allocates_nothing_of_its_own_after_warm_up() {
    let sim = Sim::start(&[]);
    let mut client: Client = sim.ticker();
    let place = client.spawn_points().unwrap()[0];
    let ego = client.spawn(Spawn::new("vehicle.tesla.model3", place)).unwrap();
    let above = Pose::new(Vec3::Z * 60.0, Quat::IDENTITY);
    let spec = camera("c", above, 64, 48, 1.5, CameraOutputs::COLOR | CameraOutputs::DEPTH);
    let mut bundle = client.create_bundle("above", ActorId::NONE, [spec], 2).unwrap();
    // A snapshot shows the vehicle from the next frame on.
    client.tick().unwrap();
    bundle.latest().unwrap();
    let (mut observer, mut controller) = client.split();
    let mut images = 0;
    // Returns the allocations of sending controls, and those of the rest of the loop.
    let mut drive = |frames: u32| {
        let (mut of_sending, mut of_the_rest) = (0, 0);
        for _ in 0..frames {
            of_sending += allocations_of(|| {
                let ego = observer.world().actor(ego).expect("a snapshot has shown it");
                let throttle = (0.2 * (8.0 - ego.speed_mps())).clamp(0.0, 0.8);
                let control = VehicleControl { actor_id: ego.id(), throttle, ..Default::default() };
                controller.control(&[control]).unwrap();
            });
            of_the_rest += allocations_of(|| {
                let frame = controller.tick().unwrap();
                assert_eq!(observer.await_frame().unwrap(), frame);
                let measurement = bundle.latest().unwrap().expect("the frame was measured");
                let image = measurement.color_image(0).expect("the camera gives colours");
                let depth = measurement.depth_image(0).expect("the camera gives depths");
                black_box((image.pixel(0, 0), depth.rows().next()));
                images += 1;
            });
        }
        (of_sending, of_the_rest)
    };
    drive(30);
    let (of_sending, of_the_rest) = drive(100);
    assert_eq!(images, 130);
    assert_eq!(of_the_rest, 0, "tick, snapshot or images allocated in 100 frames");
    // iceoryx2 0.10 counts the owners of each loan in a chunk of its own
    // (`ChunkMutSharedState::new`); nothing else is allocated.
    assert_eq!(of_sending, 100, "100 batches of controls are 100 loans of the transport");
    drop((bundle, observer, controller));
    sim.end();
}
