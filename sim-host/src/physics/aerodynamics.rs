//! Aerodynamic forces.

use super::{
    model::VehicleModel,
    motion::{Motion, Wrench},
};

pub(super) const AIR_DENSITY_KGPM3: f32 = 1.2;

pub(super) fn add_aerodynamic_forces(model: &VehicleModel, motion: &Motion, wrench: &mut Wrench) {
    let speed = motion.velocity_mps.length();
    let pressure = 0.5 * AIR_DENSITY_KGPM3 * speed;
    let drag_area_m2 = model.drag_coefficient * model.frontal_m2;
    wrench.force_n -= motion.velocity_mps * (pressure * drag_area_m2)
        + motion.axes.z_axis * (pressure * speed * model.downforce_area_m2);
}
