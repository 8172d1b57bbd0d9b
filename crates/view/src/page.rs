//! One open page: a client of the simulator, on a thread of its own.

use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError},
    },
    time::{Duration, Instant},
};

use axum::extract::ws::Message;
use client_lib::{
    ActorId, Client, ClientError, Command, Pose, RefusalCode, Spawn, Tag, VehicleControl, Waiter,
    wire,
};

use crate::{
    ViewError,
    flow::Flow,
    map,
    message::{Pedals, Reply, Request, STATE_CHANNEL, SpawnRequest},
    outbox::Outbox,
    player::{Player, locked},
    state::{Own, State},
    tiles::Tiles,
    time_control::TimeControl,
};

/// How often the page looks for frames and measurements. Requests are served at once.
const LOOK_EVERY: Duration = Duration::from_millis(4);

/// An open page.
pub(crate) struct Page {
    client: Client,
    waiter: Waiter,
    outbox: Outbox,
    episode: u32,
    own: Own,
    state: Flow,
    /// The frame of the state that was sent last, and whether something beside the world has changed.
    sent: u64,
    is_changed: bool,
    /// Whether the page's own vehicle was in a snapshot: a new one is in the next.
    is_ego_seen: bool,
    tiles: Tiles,
    time: TimeControl,
    /// The player of a recording, in place of `time`, and how often it had looked for another part.
    player: Option<Arc<Mutex<Player>>>,
    seeks: u64,
}

impl Page {
    /// Serves the page until its connection or the simulator ends, or `stop` is set.
    pub(crate) fn serve(
        mut client: Client,
        player: Option<Arc<Mutex<Player>>>,
        requests: &Receiver<String>,
        outbox: Outbox,
        stop: &AtomicBool,
    ) {
        let waiter = client.observer().waiter();
        let mut page = Page {
            client,
            waiter,
            outbox,
            episode: 0,
            own: Own::default(),
            state: Flow::default(),
            sent: 0,
            is_changed: true,
            is_ego_seen: false,
            tiles: Tiles::default(),
            time: TimeControl::default(),
            player,
            seeks: 0,
        };
        let message = match page.run(requests, stop) {
            Ok(()) => "the viewer has ended".to_owned(),
            Err(e) => e.to_string(),
        };
        page.outbox.text(&Reply::Ended { message });
        page.leave();
    }

    /// Says why there is nothing to be served.
    pub(crate) fn refuse_all(mut outbox: Outbox, why: &ClientError) {
        outbox.text(&Reply::Ended { message: why.to_string() });
    }

    fn run(&mut self, requests: &Receiver<String>, stop: &AtomicBool) -> Result<(), ClientError> {
        self.client.follow_wire_commands()?;
        while !stop.load(Ordering::Acquire) && !self.outbox.is_full() {
            // Without waiting: whether the host has ended.
            self.waiter.next_frame(self.client.frame(), Duration::ZERO)?;
            self.client.refresh()?;
            self.follow_episode()?;
            self.follow_commands();
            let (ticked, due) = self.tick_if_due();
            if let Err(e) = ticked {
                self.refuse("play", &ended(e.into())?);
            }
            self.send()?;
            let wait = due.unwrap_or(LOOK_EVERY).min(LOOK_EVERY);
            let mut next = requests.recv_timeout(wait);
            while let Ok(text) = next {
                self.answer(&text)?;
                next = requests.try_recv().map_err(|_| RecvTimeoutError::Timeout);
            }
            if let Err(RecvTimeoutError::Disconnected) = next {
                break;
            }
        }
        Ok(())
    }

    /// Lets time pass as far as that is this page's part; returns the time until it is due again.
    fn tick_if_due(&mut self) -> (Result<(), ClientError>, Option<Duration>) {
        let Some(player) = &self.player else {
            let ticked = self.time.tick_if_due(&mut self.client).map(drop);
            return (ticked, self.time.until_due(Instant::now()));
        };
        let mut player = locked(player);
        let ticked = player.tick_if_due();
        (self.own.plays, self.own.playback) = (player.plays(), Some(player.playback()));
        if self.seeks != player.seeks() {
            self.seeks = player.seeks();
            self.tiles.remount();
            self.is_changed = true;
        }
        (ticked, player.until_due(Instant::now()))
    }

    /// Says which world this is, first of all and whenever another was loaded.
    fn follow_episode(&mut self) -> Result<(), ClientError> {
        if self.episode == self.client.episode() {
            return Ok(());
        }
        self.episode = self.client.episode();
        let weather = Some(self.client.weather()?.into());
        self.own = Own { weather, ..Own::default() };
        (self.tiles, self.is_changed) = (Tiles::default(), true);
        let [name, map] = match &self.player {
            Some(player) => locked(player).title(),
            None => {
                let instance = self.client.instance();
                [instance.id().to_owned(), instance.episode()?.map]
            }
        };
        let blueprints = self.client.blueprints().iter();
        self.outbox.text(&Reply::Hello {
            source: if self.player.is_some() { "recording" } else { "simulator" },
            name: &name,
            map: &map,
            blueprints: blueprints.map(|b| (b.id.as_str(), b.half_extents_m)).collect(),
            tag_colors: Tag::ALL.iter().map(|tag| tag.color()).collect(),
            sensors: &[],
        });
        let lanes = map::message(&*self.client.map()?);
        self.outbox.send(Message::binary(lanes));
        Ok(())
    }

    /// Follows the weather that other clients set.
    fn follow_commands(&mut self) {
        // Lost commands are commands of others that this page did not read in time.
        while let Ok(Some(entry)) = self.client.next_wire_command() {
            if let Some(wire::Command::SetWeather(weather)) = entry.command.decode()
                && entry.outcome.result().is_ok()
            {
                self.own.weather = Some(weather.into());
                self.is_changed = true;
            }
        }
    }

    fn send(&mut self) -> Result<(), ClientError> {
        if let Some(gone) = self.tiles.drop_orphans(&self.client) {
            self.refuse("tiles", &format!("{gone}, which carried a sensor, was destroyed"));
        }
        let world = self.client.world();
        let is_there = self.own.ego.is_some_and(|ego| world.actor(ego).is_some());
        if self.is_ego_seen && !is_there {
            self.own.ego = None;
        }
        self.is_ego_seen = is_there;
        let outbox = &mut self.outbox;
        let sent = self.tiles.send(&mut self.client, |bytes| outbox.send(Message::binary(bytes)));
        if let Err(e) = sent {
            self.refuse("tiles", &ended(e.into())?);
        }
        let (now, frame) = (Instant::now(), self.client.frame().0);
        if (frame != self.sent || self.is_changed) && self.state.is_open(now) {
            if self.player.is_none() {
                self.own.plays = self.time.plays();
            }
            if self.outbox.text(&State::new(&self.client, &self.own)) {
                self.state.send(now);
                (self.sent, self.is_changed) = (frame, false);
            }
        }
        Ok(())
    }

    /// Carries out a request and replies to it.
    ///
    /// # Errors
    ///
    /// [`ClientError::HostEnded`].
    fn answer(&mut self, text: &str) -> Result<(), ClientError> {
        let request: Request = match serde_json::from_str(text) {
            Ok(request) => request,
            Err(e) => {
                self.refuse("unknown", &e.to_string());
                return Ok(());
            }
        };
        let name = request.name();
        match request {
            Request::Ack { channel: STATE_CHANNEL } => self.state.acknowledge(Instant::now()),
            Request::Ack { channel } => self.tiles.acknowledge(channel),
            Request::Drive(pedals) => {
                // Without a reply to each key.
                if let Err(e) = self.drive(pedals) {
                    self.refuse(name, &ended(e)?);
                }
            }
            other => match self.perform(other) {
                Ok(id) => self.reply(name, Ok(id)),
                Err(e) => {
                    let why = ended(e)?;
                    self.reply(name, Err(why));
                }
            },
        }
        Ok(())
    }

    /// Carries out a request that changes the world, or what is shown of it. Returns the actor that it
    /// made.
    fn perform(&mut self, request: Request) -> Result<Option<u32>, ViewError> {
        self.is_changed = true;
        match request {
            Request::Sensors { .. } => return Err(ViewError::NoDataSet),
            Request::Tiles { tiles } => {
                self.tiles.replace(&mut self.client, &tiles)?;
                if let Some(player) = &self.player {
                    locked(player).refresh()?;
                }
            }
            Request::Select { id } => self.own.selected = id.map(ActorId),
            Request::Spawn(spawn) => return self.spawn(&spawn).map(|id| Some(id.0)),
            Request::Destroy { id } => self.client.destroy(ActorId(id))?,
            Request::Autopilot { on } => {
                self.client.set_autopilot(self.own.ego.ok_or(ViewError::NoVehicle)?, on)?;
            }
            Request::Weather(sky) => {
                self.client.set_weather(sky.into())?;
                self.own.weather = Some(sky);
            }
            Request::Pause {} => match &self.player {
                Some(player) => locked(player).pause()?,
                None => self.time.pause(&mut self.client)?,
            },
            Request::Step {} => match &self.player {
                Some(player) => locked(player).step()?,
                None => self.time.step(&mut self.client)?,
            },
            Request::Play {} => match &self.player {
                Some(player) => locked(player).play()?,
                None => self.time.play(&mut self.client)?,
            },
            Request::Seek { to } => {
                locked(self.player.as_ref().ok_or(ViewError::NoLength)?).seek(to)?;
            }
            Request::Ack { .. } | Request::Drive(_) => {}
        }
        Ok(None)
    }

    fn drive(&mut self, pedals: Pedals) -> Result<(), ViewError> {
        let Pedals { throttle, brake, steer, handbrake, reverse } = pedals;
        let actor_id = self.own.ego.ok_or(ViewError::NoVehicle)?;
        let control = VehicleControl {
            actor_id,
            throttle: throttle.clamp(0.0, 1.0),
            brake: brake.clamp(0.0, 1.0),
            steer: steer.clamp(-1.0, 1.0),
            handbrake,
            reverse,
            gear: None,
        };
        Ok(self.client.control(&[control])?)
    }

    fn spawn(&mut self, request: &SpawnRequest) -> Result<ActorId, ViewError> {
        let mut places = self.client.spawn_points()?;
        if let Some([x, y]) = request.near_m {
            let squared = |pose: &Pose| {
                let [px, py, _] = pose.position_m;
                (px - x).powi(2) + (py - y).powi(2)
            };
            places.sort_by(|a, b| squared(a).total_cmp(&squared(b)));
        }
        if request.ego
            && let Some(before) = self.own.ego.take()
        {
            // It may have been destroyed by others.
            let _ = self.client.destroy(before);
        }
        for place in &places {
            let mut spawn = Spawn::new(&request.blueprint, *place);
            if request.autopilot {
                spawn = spawn.autopilot();
            }
            if request.ego {
                spawn = spawn.role("hero");
            }
            match self.client.spawn(spawn) {
                Err(e) if e.refusal() == Some(RefusalCode::SpawnCollision) => {}
                Err(e) => return Err(e.into()),
                Ok(id) => {
                    if request.ego {
                        (self.own.ego, self.is_ego_seen) = (Some(id), false);
                    }
                    return Ok(id);
                }
            }
        }
        Err(ViewError::NoPlace { count: places.len() })
    }

    fn reply(&mut self, request: &'static str, result: Result<Option<u32>, String>) {
        self.outbox.text(&match result {
            Ok(id) => Reply::Done { request, id },
            Err(message) => Reply::Error { request, message },
        });
    }

    fn refuse(&mut self, request: &'static str, why: &str) {
        self.reply(request, Err(why.to_owned()));
    }

    /// Leaves the world as it was but for what other actors have done: time passes as before, and the
    /// page's own vehicle is destroyed, because nothing drives it.
    fn leave(mut self) {
        if let Some(ego) = self.own.ego {
            let _ = self.client.send(&[Command::destroy(ego)]);
        }
        // If the simulator has ended, nothing is left to be done.
        let _ = self.time.release(&mut self.client);
    }
}

/// Returns the text of an error that concerns one request only.
fn ended(error: ViewError) -> Result<String, ClientError> {
    match error {
        ViewError::Client(ended @ ClientError::HostEnded { .. }) => Err(ended),
        other => Ok(other.to_string()),
    }
}
