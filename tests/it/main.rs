//! The one integration test binary: real processes, whole scenarios.
