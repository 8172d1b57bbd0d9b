//! One connection: a client of the simulator, on a thread of its own.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError},
    },
    time::{Duration, Instant},
};

use client_lib::{ActorId, Client, ClientError, Frame, Pose, Waiter, road::Network};
use foxglove::{Message, pose_in_frame, timestamp};
use serde_json::{Value, json};

use crate::{
    player::{Player, locked},
    state::{Timeline, timeline},
    stream::{
        protocol::{self, Level, Request, status},
        queue::Queue,
        scene,
        sensors::{self, Sensors, Wanted},
        subscriptions::Subscriptions,
        topics::{Topic, advertisement},
    },
};

/// Draws a map at a simulated time in nanoseconds: `foxglove.SceneUpdate` of its lines.
pub type MapScene = fn(&Network, u64) -> foxglove::Message;

/// How often the thread looks for frames and measurements. Requests are served at once.
const LOOK_EVERY: Duration = Duration::from_millis(4);
/// The shortest time between two frames that are sent: 30 a second, as to a page.
const INTERVAL_MIN: Duration = Duration::from_millis(31);
/// The shortest time between two reports of dropped messages.
const REPORT_EVERY: Duration = Duration::from_secs(1);
/// Statuses that others take the place of.
const DROPPED: &str = "dropped";
const SENSORS: &str = "sensors";

/// What a client sends.
pub(crate) enum Received {
    Text(String),
    /// What only a client that publishes sends.
    Binary,
}

/// An open connection.
pub(crate) struct Stream<'a> {
    client: Client,
    waiter: Waiter,
    queue: &'a Queue,
    map_scene: MapScene,
    episode: u32,
    subscriptions: Subscriptions,
    sensors: Sensors,
    /// The fault of the sensors that was said last.
    fault: Option<String>,
    /// The frame whose time was sent last, and when the next one is due.
    sent: Option<Frame>,
    due: Instant,
    /// How many dropped messages were reported, and when.
    reported: (u64, Instant),
    /// The player of a recording, and how often it had looked for another part.
    player: Option<Arc<Mutex<Player>>>,
    seeks: u64,
}

impl Stream<'_> {
    /// Serves a client until its connection or the simulator ends, or `stop` is set.
    pub(crate) fn serve(
        mut client: Client,
        player: Option<Arc<Mutex<Player>>>,
        map_scene: MapScene,
        requests: &Receiver<Received>,
        queue: &Queue,
        stop: &AtomicBool,
    ) {
        let waiter = client.observer().waiter();
        let now = Instant::now();
        let mut stream = Stream {
            client,
            waiter,
            queue,
            map_scene,
            episode: 0,
            subscriptions: Subscriptions::default(),
            sensors: Sensors::default(),
            fault: None,
            sent: None,
            due: now,
            reported: (0, now),
            player,
            seeks: 0,
        };
        if let Err(e) = stream.run(requests, stop) {
            Self::refuse_all(queue, &e.to_string());
        }
        queue.close();
    }

    /// Says why nothing is served any longer.
    pub(crate) fn refuse_all(queue: &Queue, why: &str) {
        queue.text(&status(Level::Error, why, None));
        queue.close();
    }

    fn run(&mut self, requests: &Receiver<Received>, stop: &AtomicBool) -> Result<(), ClientError> {
        let instance = self.client.instance().id().to_owned();
        let session = format!("{instance}-{:x}", self.client.world().published_nanos());
        self.queue.text(&protocol::server_info(&format!("omnibus {instance}"), &session));
        self.queue.text(&advertisement());
        while !stop.load(Ordering::Acquire) && !self.queue.is_closed() {
            // Without waiting: whether the host has ended.
            self.waiter.next_frame(self.client.frame(), Duration::ZERO)?;
            self.client.refresh()?;
            self.follow_episode();
            let wait = self.play()?.unwrap_or(LOOK_EVERY).min(LOOK_EVERY);
            if self.queue.is_stalled() {
                // Nothing is rendered for a client that reads nothing.
                self.sensors.clear();
            } else {
                self.send()?;
                self.report();
            }
            let mut next = requests.recv_timeout(wait);
            while let Ok(request) = next {
                if let Err(why) = self.answer(request) {
                    self.queue.text(&status(Level::Error, &why, None));
                }
                next = requests.try_recv().map_err(|_| RecvTimeoutError::Timeout);
            }
            if let Err(RecvTimeoutError::Disconnected) = next {
                break;
            }
        }
        Ok(())
    }

    fn follow_episode(&mut self) {
        if self.episode != self.client.episode() {
            self.episode = self.client.episode();
            self.sent = None;
            self.subscriptions.renew();
            self.sensors.clear();
        }
    }

    /// Lets time of a recording pass, and returns the time until that is due again.
    fn play(&mut self) -> Result<Option<Duration>, ClientError> {
        let Some(player) = &self.player else { return Ok(None) };
        let mut player = locked(player);
        player.tick_if_due()?;
        if self.seeks != player.seeks() {
            self.seeks = player.seeks();
            self.sensors.clear();
        }
        Ok(player.until_due(Instant::now()))
    }

    fn answer(&mut self, request: Received) -> Result<(), String> {
        let Received::Text(text) = request else {
            return Err("binary messages are not read: this server has no clientPublish".to_owned());
        };
        let request = serde_json::from_str(&text).map_err(|e| format!("wrong request: {e}"))?;
        let fault = match request {
            Request::Subscribe { subscriptions } => self.subscriptions.add(&subscriptions),
            Request::Unsubscribe { subscription_ids } => {
                let (removed, fault) = self.subscriptions.remove(&subscription_ids);
                removed.iter().for_each(|topic| self.queue.clear(*topic as u32));
                fault
            }
        };
        fault.map_or(Ok(()), Err)
    }

    fn send(&mut self) -> Result<(), ClientError> {
        let now = Instant::now();
        if now < self.due {
            return Ok(());
        }
        let world = self.client.observer().shared_world();
        let (frame, nanos) = (world.frame(), world.sim_time().as_nanos() as u64);
        if self.sent != Some(frame) {
            self.sent = Some(frame);
            self.queue.clock(protocol::time(nanos));
            self.due = now + INTERVAL_MIN;
        }
        let ego = scene::ego(&world);
        let blueprint = ego.and_then(|ego| self.client.blueprints().get(ego.blueprint()));
        let poses = blueprint.map(sensors::poses);
        let time = timestamp(nanos);
        let put = |id, topic: Topic, data: &[u8]| {
            self.queue.data(topic as u32, protocol::message_data(id, nanos, data));
        };
        if let Some(id) = self.subscriptions.due(Topic::Transforms, frame) {
            let spaces = poses.map(sensors::spaces);
            let spaces = spaces.as_ref().map_or(&[][..], |spaces| spaces);
            put(id, Topic::Transforms, &scene::transforms(&time, &world, spaces).0);
        }
        if let Some(id) = self.subscriptions.due(Topic::Actors, frame) {
            put(id, Topic::Actors, &scene::actors(&time, &self.client).0);
        }
        // Once: `renew` asks for it again.
        if let Some(id) = self.subscriptions.due(Topic::Map, Frame(0)) {
            put(id, Topic::Map, &(self.map_scene)(&*self.client.map()?, nanos).0);
        }
        if let Some(ego) = ego
            && let Some(id) = self.subscriptions.due(Topic::EgoPose, frame)
        {
            put(id, Topic::EgoPose, &pose_in_frame(&time, &scene::affine(&ego.pose())).0);
        }
        if self.subscriptions.of(Topic::Stages).is_some()
            && let Some(timeline) = timeline(&self.client, frame)
            && let Some(id) = self.subscriptions.due(Topic::Stages, Frame(timeline.frame))
        {
            put(id, Topic::Stages, stages(&timeline).to_string().as_bytes());
        }
        let on = ego.map(client_lib::Actor::id).zip(poses);
        let measured = self.measure(on);
        match measured {
            Err(ended @ ClientError::HostEnded { .. }) => Err(ended),
            Err(e) => {
                self.say_fault(Some(e.to_string()));
                Ok(())
            }
            Ok(is_without_ego) => {
                let none = "no vehicle carries the camera and the lidar; spawn one";
                self.say_fault(is_without_ego.then(|| none.to_owned()));
                Ok(())
            }
        }
    }

    /// Sends what the sensors have measured; returns whether they lack a vehicle.
    fn measure(&mut self, on: Option<(ActorId, [Pose; 2])>) -> Result<bool, ClientError> {
        let has = |topic| self.subscriptions.of(topic).is_some();
        let wanted = Wanted {
            camera: has(Topic::Image) || has(Topic::Calibration),
            lidar: has(Topic::Points),
        };
        self.sensors.mount(&mut self.client, on, wanted)?;
        let Some(measured) = self.sensors.newest()? else {
            return Ok(on.is_none() && wanted != Wanted::default());
        };
        let (frame, nanos) = (measured.frame(), measured.sim_time().as_nanos() as u64);
        let time = timestamp(nanos);
        let makers: [(Topic, &dyn Fn() -> Option<Message>); 3] = [
            (Topic::Calibration, &|| Some(sensors::calibration(&time))),
            (Topic::Image, &|| sensors::image(&time, measured)),
            (Topic::Points, &|| sensors::points(&time, measured)),
        ];
        for (topic, make) in makers {
            if let Some(id) = self.subscriptions.due(topic, frame)
                && let Some(message) = make()
            {
                self.queue.data(topic as u32, protocol::message_data(id, nanos, &message.0));
            }
        }
        Ok(false)
    }

    /// Says what is wrong with the sensors, once, and that it is no longer so.
    fn say_fault(&mut self, fault: Option<String>) {
        if self.fault == fault {
            return;
        }
        self.queue.text(&match &fault {
            Some(why) => status(Level::Warning, why, Some(SENSORS)),
            None => protocol::status_removal(SENSORS),
        });
        self.fault = fault;
    }

    /// Reports how many messages were dropped.
    fn report(&mut self) {
        let dropped = self.queue.dropped();
        let (reported, since) = self.reported;
        if dropped != reported && since.elapsed() >= REPORT_EVERY {
            self.reported = (dropped, Instant::now());
            let why = format!("{dropped} messages were dropped: this client reads too slowly");
            self.queue.text(&status(Level::Warning, &why, Some(DROPPED)));
        }
    }
}

/// Returns the parts of a frame: `{"frame": …, "host": {"physics_ms": …}}`.
fn stages(timeline: &Timeline) -> Value {
    let mut stages: BTreeMap<&str, BTreeMap<String, f64>> = BTreeMap::new();
    for (stage, part, begin, end) in &timeline.parts {
        stages.entry(stage).or_default().insert(format!("{part}_ms"), end - begin);
    }
    let mut message = json!(stages);
    message["frame"] = timeline.frame.into();
    message
}
