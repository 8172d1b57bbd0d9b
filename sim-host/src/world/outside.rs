//! Commands about how vehicles are built and how actors are moved from outside, and questions.

use glam::Vec3;
use protocol::{
    ActorId, ApplyForce, Ask, Command, Outcome, SetWeatherAffectsGrip, Switch, VehicleBody,
    VehiclePhysics, VehicleWheel, Weather, part,
};

use super::World;
use crate::physics::PhysicsError;

impl World {
    /// Carries out one of these commands; `None` if it is another.
    pub(super) fn apply_outside(&mut self, command: &Command) -> Option<Result<u32, String>> {
        Some(match command {
            Command::SetBody(to) => self.rebuild(to.actor_id, |physics| with_body(physics, to)),
            Command::SetEngine(to) => self.rebuild(to.actor_id, |physics| {
                physics.engine = *to;
                Ok(())
            }),
            Command::SetGearbox(to) => self.rebuild(to.actor_id, |physics| {
                physics.gearbox = *to;
                Ok(())
            }),
            Command::SetSteering(to) => self.rebuild(to.actor_id, |physics| {
                physics.steering = *to;
                Ok(())
            }),
            Command::SetWheel(to) => self.rebuild(to.actor_id, |physics| with_wheel(physics, to)),
            Command::ApplyForce(push) => self.push(push),
            Command::SetGravity(Switch { actor_id, on }) => self
                .there(*actor_id)
                .and_then(|id| self.physics.set_gravity(id, *on != 0).map_err(words))
                .map(|()| actor_id.0),
            Command::SetCollisions(Switch { actor_id, on }) => self
                .there(*actor_id)
                .and_then(|id| self.physics.set_collisions(id, *on != 0).map_err(words))
                .map(|()| actor_id.0),
            Command::Jump(id) => {
                self.there(*id).and_then(|id| self.physics.jump(id).map_err(words)).map(|()| id.0)
            }
            Command::Ackermann(control) => self
                .driver(control.actor_id)
                .and_then(|()| self.physics.ackermann(control).map_err(words))
                .map(|()| control.actor_id.0),
            Command::SetAckermann(settings) => self
                .driver(settings.actor_id)
                .and_then(|()| self.physics.set_ackermann(settings).map_err(words))
                .map(|()| settings.actor_id.0),
            Command::SetWeather(weather) => {
                self.weather_grip = grip_under(weather);
                self.see_to_grip();
                Ok(0)
            }
            Command::SetWeatherAffectsGrip(SetWeatherAffectsGrip { on, .. }) => {
                self.weather_affects_grip = *on != 0;
                self.see_to_grip();
                Ok(0)
            }
            _ => return None,
        })
    }

    /// What is asked of an actor.
    pub(crate) fn answer(&mut self, ask: &Ask) -> Outcome {
        match self.answer_or_why(ask) {
            Ok(outcome) => outcome,
            Err(why) => Outcome::refused(&why),
        }
    }

    fn answer_or_why(&mut self, ask: &Ask) -> Result<Outcome, String> {
        let (id, index) = (ask.actor_id, ask.index);
        match ask.part {
            part::BONES => return self.tell_bones(id, index),
            part::BLEND => return self.tell_blend(id),
            _ => {}
        }
        self.driver(id)?;
        let physics = || self.physics.vehicle_physics(id).map_err(words);
        Ok(match ask.part {
            part::BODY => Outcome::answer(id.0, &physics()?.body),
            part::ENGINE => Outcome::answer(id.0, &physics()?.engine),
            part::GEARBOX => Outcome::answer(id.0, &physics()?.gearbox),
            part::STEERING => Outcome::answer(id.0, &physics()?.steering),
            part::WHEEL => {
                let physics = physics()?;
                let wheel = physics.wheels.get(index as usize);
                Outcome::answer(id.0, wheel.ok_or_else(|| no_wheel(id, index, &physics))?)
            }
            part::TELEMETRY => Outcome::answer(id.0, &self.physics.telemetry(id).map_err(words)?),
            part::WHEEL_TELEMETRY => {
                let told = self.physics.wheel_telemetry(id, index).map_err(words)?;
                Outcome::answer(id.0, &told)
            }
            part::ACKERMANN => {
                let settings = self.physics.ackermann_settings(id).map_err(words)?;
                Outcome::answer(id.0, &settings)
            }
            other => return Err(format!("part {other} is none that can be asked for")),
        })
    }

    fn rebuild(
        &mut self,
        id: ActorId,
        change: impl FnOnce(&mut VehiclePhysics) -> Result<(), String>,
    ) -> Result<u32, String> {
        self.driver(id)?;
        let mut physics = self.physics.vehicle_physics(id).map_err(words)?;
        change(&mut physics)?;
        self.physics.set_vehicle_physics(id, &physics).map_err(words)?;
        Ok(id.0)
    }

    fn push(&mut self, push: &ApplyForce) -> Result<u32, String> {
        let id = self.there(push.actor_id)?;
        let [linear, angular, at] = [push.linear, push.angular, push.at_m].map(Vec3::from_array);
        let at = (push.has_point != 0).then_some(at);
        if push.is_force == 0 {
            self.physics.impulse(id, linear, angular, at).map_err(words)?;
        } else {
            self.physics.force(id, linear, angular, at).map_err(words)?;
        }
        Ok(id.0)
    }

    fn see_to_grip(&mut self) {
        self.physics.set_grip(if self.weather_affects_grip { self.weather_grip } else { 1.0 });
    }

    fn there(&mut self, id: ActorId) -> Result<ActorId, String> {
        self.movable(id).map(|_| id)
    }

    fn driver(&mut self, id: ActorId) -> Result<(), String> {
        self.vehicle(id, "engine").map(drop)
    }
}

/// Wet asphalt has some 70 % of the friction that dry asphalt has, and standing water takes as much
/// again (Wong, Theory of Ground Vehicles, 4th ed., table 1.8).
pub(super) fn grip_under(weather: &Weather) -> f32 {
    let share = |percent: f32| (percent / 100.0).clamp(0.0, 1.0);
    (1.0 - 0.3 * share(weather.wetness)) * (1.0 - 0.3 * share(weather.precipitation_deposits))
}

fn with_body(physics: &mut VehiclePhysics, to: &VehicleBody) -> Result<(), String> {
    let count = physics.body.wheels;
    if to.wheels != count {
        return Err(format!("{} has {count} wheels, not {}", to.actor_id, to.wheels));
    }
    physics.body = *to;
    Ok(())
}

fn with_wheel(physics: &mut VehiclePhysics, to: &VehicleWheel) -> Result<(), String> {
    let missing = no_wheel(to.actor_id, to.index, physics);
    let wheel = physics.wheels.get_mut(to.index as usize).ok_or(missing)?;
    // Where it sits is the blueprint's.
    *wheel = VehicleWheel { hub_m: wheel.hub_m, ..*to };
    Ok(())
}

fn no_wheel(id: ActorId, index: u32, physics: &VehiclePhysics) -> String {
    format!("{id} has {} wheels; there is no wheel {index}", physics.wheels.len())
}

fn words(why: PhysicsError) -> String {
    why.to_string()
}
