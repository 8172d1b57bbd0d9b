//! The judge: see `it/`.
