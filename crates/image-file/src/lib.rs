//! Image files in memory.

mod jpeg;

pub use jpeg::{FULL_COLOR_QUALITY, JpegError, MAX_JPEG_SIDE_PX, Pixels, jpeg};
