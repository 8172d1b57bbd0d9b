//! Image files in memory.

mod deflate;
mod jpeg;
mod png;

pub use jpeg::{FULL_COLOR_QUALITY, JpegError, MAX_JPEG_SIDE_PX, Pixels, jpeg};
pub use png::{Filter, PngError, Samples, png};
