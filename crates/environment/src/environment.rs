//! Episodes: ego vehicles on courses among vehicles in traffic.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, OnceLock, PoisonError},
};

use bake::Cache;
use glam::{Vec2, Vec3};
use mesh::RandomStream;
use protocol::{
    ActorId, ActorState, Command, Episode, Name, Pose, Settings, Spawn, flag, kind, status,
};
use road::{LanePoint, Network};
use sensor_render::{RenderError, Scene, scene_from};
use town::Town;

use crate::{
    birds_eye::{ACTORS, Canvas, EGO as OWN, SOLIDS},
    camera::CameraView,
    config::{Config, Physics},
    course::Course,
    ego::{Action, Ego, Step, control},
    error::EnvironmentError,
    lidar::{BoxGrid, Lidar, UprightBox},
    road_raster::RoadRaster,
    simulation::Simulation,
};

/// The name of the random stream of an episode.
const EPISODE: u64 = u64::from_le_bytes(*b"episode ");
/// The ego vehicle.
const EGO: &str = "vehicle.tesla.model3";
/// Height of a spawn point above the road. Metres.
const START_HEIGHT_M: f64 = 0.5;
/// Frames at the beginning of an episode in which vehicles settle on their wheels.
const SETTLING_FRAMES: u32 = 10;
/// Least distance between two vehicles at the beginning. Metres.
const APART_M: f32 = 12.0;
/// Distance from ego vehicles beyond which kinematic vehicles have no contacts: more than two
/// vehicles are long and drive in a frame. Metres.
const FAR_M: f32 = 25.0;
/// Height of the lidar above the ego vehicle's origin. Metres.
const LIDAR_HEIGHT_M: f32 = 0.8;

/// A map, and what environments on it share.
pub struct EnvironmentMap {
    network: Arc<Network>,
    /// A simulation that never steps.
    blank: Simulation,
    solids: BoxGrid,
    places: Vec<(LanePoint, Pose)>,
    cars: Vec<Name>,
    source: Source,
    /// The rasters of roads that environments have used, by the bits of the size of their cells.
    rasters: Mutex<BTreeMap<u32, Arc<RoadRaster>>>,
    /// What cameras see, since one of an environment first rendered.
    scene: Mutex<Option<Arc<Scene>>>,
}

/// Where the meshes of a map come from, when an observation needs them.
enum Source {
    Cache { cache: Cache, episode: Episode },
    Town(Arc<Town>),
}

impl EnvironmentMap {
    /// Loads a map, from the cache if possible. `seed` decides how the town is furnished.
    ///
    /// # Errors
    /// [`EnvironmentError::Map`] with the line of the file.
    pub fn load(
        cache: &Cache,
        name: &str,
        open_drive: &str,
        seed: u64,
    ) -> Result<EnvironmentMap, EnvironmentError> {
        let network = Arc::new(cache.network(name, open_drive)?);
        let town = cache.solids_around(&network, open_drive, seed);
        let episode = Episode { map: name.to_owned(), seed, open_drive: open_drive.to_owned() };
        let blank = Simulation::cached(cache, &network, &town, &episode);
        let source = Source::Cache { cache: cache.clone(), episode };
        Ok(EnvironmentMap::of(network, &town, blank, source))
    }

    /// Creates the map of a furnished town.
    pub fn new(network: Arc<Network>, town: Arc<Town>, seed: u64) -> EnvironmentMap {
        let blank = Simulation::new(Arc::clone(&network), &town, seed);
        EnvironmentMap::of(network, &town, blank, Source::Town(Arc::clone(&town)))
    }

    /// Returns the roads and markings in cells of `cell_m`.
    pub(crate) fn roads(&self, cell_m: f32) -> Arc<RoadRaster> {
        let mut rasters = self.rasters.lock().unwrap_or_else(PoisonError::into_inner);
        let raster = rasters.entry(cell_m.to_bits()).or_insert_with(|| {
            Arc::new(match &self.source {
                Source::Town(town) => RoadRaster::new(&town.mesh, cell_m),
                Source::Cache { cache, episode: Episode { open_drive, seed, .. } } => {
                    let town = cache.ground_around(&self.network, open_drive, *seed);
                    RoadRaster::new(&town.mesh, cell_m)
                }
            })
        });
        Arc::clone(raster)
    }

    /// Returns what cameras see.
    fn scene(&self) -> Result<Arc<Scene>, RenderError> {
        let mut scene = self.scene.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(scene) = &*scene {
            return Ok(Arc::clone(scene));
        }
        let new = Arc::new(match &self.source {
            Source::Town(town) => Scene::of_town(town)?,
            Source::Cache { cache, episode } => scene_from(cache, episode)?,
        });
        Ok(Arc::clone(scene.insert(new)))
    }

    fn of(network: Arc<Network>, town: &Town, blank: Simulation, source: Source) -> EnvironmentMap {
        let solids: Vec<UprightBox> = town
            .colliders
            .iter()
            .map(|collider| UprightBox {
                center: collider.center,
                half_extents_m: collider.half_extents_m,
                axis: Vec2::from_angle(collider.yaw_rad),
            })
            .collect();
        let place = |at| {
            let place = network.place(at);
            let position = place.position.as_vec3() + Vec3::Z * START_HEIGHT_M as f32;
            (at, Pose::new(position, place.rotation().as_quat()))
        };
        let cars = town::catalogue().iter().filter(|blueprint| blueprint.base_type == "car");
        EnvironmentMap {
            blank,
            solids: BoxGrid::new(&solids),
            places: network.spawn_points().into_iter().map(place).collect(),
            cars: cars.map(|blueprint| Name::new(blueprint.id)).collect(),
            network,
            source,
            rasters: Mutex::default(),
            scene: Mutex::default(),
        }
    }
}

/// An environment: one world with ego vehicles.
pub struct Environment {
    map: Arc<EnvironmentMap>,
    config: Config,
    simulation: Simulation,
    egos: Vec<Ego>,
    results: Vec<Step>,
    steps: u32,
    /// The roads for the bird's-eye raster, since it was first drawn.
    roads: OnceLock<Arc<RoadRaster>>,
    /// The camera, since it first rendered.
    view: Option<CameraView>,
    /// Whether `view` has taken in the newest frame.
    is_placed: bool,
}

impl Environment {
    /// Creates an environment in its first episode.
    ///
    /// # Errors
    /// [`EnvironmentError::Config`], and those of [`Environment::reset`].
    pub fn new(
        map: Arc<EnvironmentMap>,
        config: Config,
        seed: u64,
    ) -> Result<Environment, EnvironmentError> {
        config.check()?;
        let (simulation, egos) = begin(&map, &config, seed)?;
        Ok(Environment {
            map,
            config,
            simulation,
            egos,
            results: Vec::new(),
            steps: 0,
            roads: OnceLock::new(),
            view: None,
            is_placed: false,
        })
    }

    /// Begins another episode. The same seed gives the same episode.
    ///
    /// # Errors
    /// [`EnvironmentError::NoRoute`] and [`EnvironmentError::NoPlace`] if the map is too small; the
    /// environment is unchanged then.
    pub fn reset(&mut self, seed: u64) -> Result<(), EnvironmentError> {
        (self.simulation, self.egos) = begin(&self.map, &self.config, seed)?;
        self.steps = 0;
        self.is_placed = false;
        Ok(())
    }

    /// Advances by one step, with an action for each ego vehicle, and returns the result of each.
    ///
    /// An ego vehicle whose episode has ended has no reward any more and its action is ignored; it is
    /// removed from the world. When no episode goes on nothing happens, and the world stays as it is.
    ///
    /// # Errors
    /// [`EnvironmentError::Action`] and [`EnvironmentError::Actions`]; the world is unchanged then.
    pub fn step(&mut self, actions: &[Action]) -> Result<&[Step], EnvironmentError> {
        let Environment { config, simulation, egos, results, .. } = self;
        if actions.len() != egos.len() {
            let (given, egos) = (actions.len(), egos.len());
            return Err(EnvironmentError::Actions { given, egos });
        }
        results.clear();
        results.extend(egos.iter().map(|ego| Step { reward: 0.0, ending: ego.ending() }));
        let is_active = |index: &usize| results[*index].ending.is_none();
        let active: Vec<usize> = (0..egos.len()).filter(is_active).collect();
        for &index in &active {
            actions[index].check(index)?;
        }
        if active.is_empty() {
            return Ok(results);
        }
        for ego in egos.iter().filter(|ego| ego.ending().is_some()) {
            if simulation.sim().world().state(ego.id()).is_some() {
                simulation.request(Command::Destroy(ego.id()));
            }
        }
        let mut collided = vec![false; egos.len()];
        for _ in 0..config.frames_per_step {
            for &index in &active {
                simulation.request(egos[index].control(&actions[index]));
            }
            simulation.step();
            let world = simulation.sim().world();
            for &index in &active {
                let id = egos[index].id();
                let collisions = world.physics().collisions();
                collided[index] |= collisions.iter().any(|c| c.actor == id || c.other == id);
                egos[index].observe(state(simulation, id));
            }
        }
        self.steps += 1;
        self.is_placed = false;
        let is_over = config.steps_max != 0 && self.steps >= config.steps_max;
        for &index in &active {
            results[index] = egos[index].end_step(collided[index], is_over, config);
        }
        Ok(results)
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The simulation.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The ego vehicles.
    pub fn egos(&self) -> &[Ego] {
        &self.egos
    }

    /// Measures the lidar of an ego vehicle: for each ray the distance to the next actor or solid
    /// object, as a fraction of the range; 1 if there is none. Ray `i` of `n` points `i / n` of a
    /// turn to the left of straight ahead, from the middle of the ego vehicle, 0.8 m above its
    /// origin.
    ///
    /// # Panics
    /// If there is no ego vehicle of that index.
    pub fn lidar(&self, ego: usize, out: &mut Vec<f32>) {
        out.clear();
        out.resize(self.config.lidar_rays, self.config.lidar_range_m);
        if out.is_empty() {
            return;
        }
        let ego = &self.egos[ego];
        let range_m = self.config.lidar_range_m;
        let origin = ego.actor().pose.position() + Vec3::Z * LIDAR_HEIGHT_M;
        let lidar = Lidar { origin, forward: ego.forward(), range_m };
        self.map.solids.for_each_near(origin.truncate(), range_m, |solid| lidar.meet(solid, out));
        for state in self.simulation.sim().states() {
            if state.actor_id != ego.id() && state.kind != kind::TRAFFIC_LIGHT {
                lidar.meet(&box_of(state), out);
            }
        }
        out.iter_mut().for_each(|distance| *distance /= range_m);
    }
}

impl Environment {
    /// Draws the bird's-eye raster of an ego vehicle: [`BIRDS_EYE_CHANNELS`] images of
    /// `size_px` × `size_px` bytes, 0 or 255, one after the other. The vehicle is in the middle;
    /// straight ahead is up, row 0 is the farthest, column 0 is the leftmost. A pixel is set if its
    /// middle lies in the thing; road markings and thin things are at least a pixel wide.
    ///
    /// [`BIRDS_EYE_CHANNELS`]: crate::BIRDS_EYE_CHANNELS
    ///
    /// # Panics
    /// If there is no ego vehicle of that index.
    pub fn birds_eye(&self, ego: usize, out: &mut Vec<u8>) {
        let raster = self.roads.get_or_init(|| self.map.roads(self.config.birds_eye.pixel_m));
        let ego = &self.egos[ego];
        let origin = ego.actor().pose.position().truncate();
        let mut canvas = Canvas::new(&self.config.birds_eye, origin, ego.forward(), out);
        canvas.roads(raster);
        ego.route(canvas.reach_m(), |from, to, half_m| canvas.route(from, to, half_m));
        let reach_m = canvas.reach_m();
        self.map.solids.for_each_near(origin, reach_m, |solid| canvas.upright_box(SOLIDS, solid));
        for state in self.simulation.sim().states() {
            if state.actor_id != ego.id() && state.kind != kind::TRAFFIC_LIGHT {
                canvas.upright_box(ACTORS, &box_of(state));
            }
        }
        canvas.upright_box(OWN, &box_of(ego.actor()));
    }

    /// Renders the camera of an ego vehicle: `height_px` rows of `width_px` pixels from the upper left
    /// on, each of [`CameraOutput::pixel_bytes`]. The bytes are those that the renderer measures with
    /// its CPU tracer for the same camera at the same frame. The first image of a map loads its
    /// scene, or builds it.
    ///
    /// [`CameraOutput::pixel_bytes`]: crate::CameraOutput::pixel_bytes
    ///
    /// # Errors
    /// [`EnvironmentError::Camera`].
    ///
    /// # Panics
    /// If there is no ego vehicle of that index.
    pub fn camera(&mut self, ego: usize, out: &mut Vec<u8>) -> Result<(), EnvironmentError> {
        let view = match &mut self.view {
            Some(view) => view,
            none => none.insert(CameraView::new(self.map.scene()?, &self.config.camera)),
        };
        if !self.is_placed {
            view.place(&self.simulation);
            self.is_placed = true;
        }
        Ok(view.render(&self.egos[ego].actor().pose, out)?)
    }
}

/// Returns the state of an ego vehicle.
fn state(simulation: &Simulation, ego: ActorId) -> &ActorState {
    // It is destroyed after its ending only.
    simulation.sim().world().state(ego).expect("the ego vehicle exists")
}

/// Returns the bounding box of an actor, upright.
fn box_of(state: &ActorState) -> UprightBox {
    let blueprint = &town::catalogue()[state.blueprint as usize];
    let rotation = state.pose.rotation();
    UprightBox {
        center: state.pose.position() + rotation * blueprint.center_m,
        half_extents_m: blueprint.half_extents_m,
        axis: (rotation * Vec3::X).truncate().normalize_or(Vec2::X),
    }
}

/// Creates the world of an episode: ego vehicles, other vehicles and courses, and lets the vehicles
/// come to rest on their wheels.
fn begin(
    map: &EnvironmentMap,
    config: &Config,
    seed: u64,
) -> Result<(Simulation, Vec<Ego>), EnvironmentError> {
    let mut random = RandomStream::named(seed, EPISODE);
    let mut places = map.places.clone();
    for last in (1..places.len()).rev() {
        places.swap(last, random.below(last + 1));
    }
    let mut course_from =
        |(at, _): &(LanePoint, Pose)| Course::new(&map.network, *at, config.route_m, &mut random);
    let found =
        places.iter().map(&mut course_from).enumerate().find_map(|(index, c)| Some((index, c?)));
    let Some((index, course)) = found else {
        let (places, route_m) = (places.len(), config.route_m);
        return Err(EnvironmentError::NoRoute { places, route_m });
    };
    let (_, pose) = places.swap_remove(index);
    let start = course.start();
    let mut starts = vec![(pose, course)];
    let mut taken = vec![pose.position()];
    let is_free = |taken: &[Vec3], pose: &Pose| {
        taken.iter().all(|other| other.distance(pose.position()) >= APART_M)
    };
    let distance = |(_, pose): &(LanePoint, Pose)| pose.position().distance_squared(start);
    // The nearest places first: all vehicles are where the first ego vehicle drives.
    places.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    for place in &places {
        if starts.len() == config.egos {
            break;
        }
        if is_free(&taken, &place.1)
            && let Some(course) = course_from(place)
        {
            taken.push(place.1.position());
            starts.push((place.1, course));
        }
    }
    if starts.len() < config.egos {
        let (found, wanted, route_m) = (starts.len(), config.egos, config.route_m);
        return Err(EnvironmentError::NoStart { found, wanted, route_m });
    }
    let mut simulation = map.blank.restarted(seed);
    let settings = Settings {
        delta_nanos: (f64::from(config.frame_s) * 1e6).round() as u64 * 1000,
        ..*simulation.sim().settings()
    };
    simulation.apply(Command::SetSettings(settings)).result()?;
    let mut egos = Vec::new();
    for (pose, course) in starts {
        let spawn = Spawn { blueprint: Name::new(EGO), pose, ..Spawn::default() };
        egos.push((ActorId(simulation.apply(Command::Spawn(spawn)).result()?), course));
    }
    let flags = match config.physics {
        Physics::All => flag::AUTOPILOT,
        Physics::Ego => flag::AUTOPILOT | flag::KINEMATIC,
    };
    if config.physics == Physics::Ego {
        simulation.set_far(FAR_M);
    }
    let wanted = config.egos + config.vehicles;
    for (_, pose) in &places {
        if taken.len() == wanted {
            break;
        }
        if !is_free(&taken, pose) {
            continue;
        }
        let blueprint = *random.choose(&map.cars);
        let spawn = Spawn { blueprint, pose: *pose, flags, ..Spawn::default() };
        if simulation.apply(Command::Spawn(spawn)).status == status::DONE {
            taken.push(pose.position());
        }
    }
    if taken.len() < wanted {
        let (found, wanted) = (taken.len() - config.egos, config.vehicles);
        return Err(EnvironmentError::NoPlace { found, wanted });
    }
    for _ in 0..SETTLING_FRAMES {
        egos.iter().for_each(|(id, _)| simulation.request(control(*id, [0.0, -1.0])));
        simulation.step();
    }
    let ego = |(id, course)| Ego::new(id, *state(&simulation, id), course);
    let egos = egos.into_iter().map(ego).collect();
    Ok((simulation, egos))
}
