//! Bits of a body's `user_data`, which is saved with the body.

/// The vehicle is dormant.
pub(super) const DORMANT: u128 = 1;
/// A sensor bundle was mounted on the actor.
pub(super) const CARRIER: u128 = 2;
/// A client has driven the vehicle.
pub(super) const DRIVEN: u128 = 4;
