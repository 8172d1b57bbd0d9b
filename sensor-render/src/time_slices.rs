//! Worlds at several times of the exposure of a camera, for motion blur.
//!
//! Each ray of a pixel sees the world and the camera at another time. With so few times the actors can be
//! placed anew for each, so that shadows, reflections and lamps are right without a hierarchy over moving
//! boxes: P. Haeberli and K. Akeley, *The Accumulation Buffer*, SIGGRAPH 1990.

use protocol::{ActorState, EffectsSpec, Pose, flag};

/// Rays of a pixel at most.
pub(crate) const RAYS_MAX: usize = 16;

/// Returns for each of the rays of a pixel how far back it looks, as a share of the way from this frame to
/// the previous one. The times are in the order of van der Corput's sequence, so that they do not follow the
/// places of the rays in the pixel.
pub(crate) fn shares(effects: &EffectsSpec, rays: usize, delta_nanos: u64) -> [f32; RAYS_MAX] {
    let whole = effects.blur_secs * 1e9 / delta_nanos.max(1) as f32;
    let bits = rays.max(1).ilog2();
    std::array::from_fn(|ray| {
        let turned = if bits == 0 { 0 } else { (ray as u32).reverse_bits() >> (32 - bits) };
        let blurs = bits > 0 && ray < rays;
        if blurs { whole * (turned as f32 + 0.5) / rays as f32 } else { 0.0 }
    })
}

/// Returns the actors at a share of the way from this frame to the previous one. Actors that did not exist
/// before, or were teleported since, do not move.
pub(crate) fn actors_at(
    share: f32,
    before: &[ActorState],
    actors: &[ActorState],
) -> Vec<ActorState> {
    let at = |actor: &ActorState| {
        let was = before.binary_search_by_key(&actor.actor_id, |was| was.actor_id);
        let Ok(was) = was.map(|index| &before[index]) else { return *actor };
        let is_same = was.blueprint == actor.blueprint && !actor.has(flag::TELEPORTED);
        if !is_same || !was.pose.is_valid() || !actor.pose.is_valid() {
            return *actor;
        }
        let position = actor.pose.position().lerp(was.pose.position(), share);
        let rotation = actor.pose.rotation().slerp(was.pose.rotation(), share);
        ActorState { pose: Pose::new(position, rotation.normalize()), ..*actor }
    };
    actors.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_times_of_rays_divide_the_exposure_evenly() {
        let effects = EffectsSpec { blur_secs: 0.02, ..EffectsSpec::default() };
        let mut times = shares(&effects, 4, 50_000_000);
        assert_eq!(times[4..], [0.0; 12]);
        assert!(times[0] < times[1] && times[1] > times[2], "they do not rise with the rays");
        times[..4].sort_by(f32::total_cmp);
        for (time, wanted) in times.into_iter().zip([0.05, 0.15, 0.25, 0.35]) {
            assert!((time - wanted).abs() < 1e-6, "{time} {wanted}");
        }
        assert_eq!(shares(&effects, 1, 50_000_000), [0.0; 16]);
    }
}
