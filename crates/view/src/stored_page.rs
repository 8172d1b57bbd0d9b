//! One open page of a data set, on a thread of its own.

use std::{
    sync::{
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError},
    },
    time::{Duration, Instant},
};

use axum::extract::ws::Message;
use client_lib::{Tag, road::Network};

use crate::{
    ViewError,
    data_set::{DataSet, ReadError, StoredFrame},
    encode,
    flow::Flow,
    map,
    message::{BoxLine, Reply, Request, STATE_CHANNEL, SensorTile},
    outbox::Outbox,
    state::{Playback, State},
    tiles::TILES_MAX,
};

/// How often the page looks whether a frame is due.
const LOOK_EVERY: Duration = Duration::from_millis(4);
/// The longest time that a frame is shown while time passes; a scene may begin later than another ends.
const SHOWN_MAX: Duration = Duration::from_secs(1);

/// An open page of a data set.
pub(crate) struct StoredPage<'a> {
    set: &'a dyn DataSet,
    outbox: Outbox,
    shown: Shown,
    scene: Option<usize>,
    /// The OpenDRIVE text that was sent last: the scenes of a set often have one map.
    open_drive: String,
    selected: Option<u32>,
    state: Flow,
    is_changed: bool,
    tiles: Vec<Tile>,
    /// When the next frame is due; `None`: time stands.
    due: Option<Instant>,
}

/// The frame that is shown.
struct Shown {
    index: usize,
    frame: StoredFrame,
}

/// A tile, and what the page has of it.
struct Tile {
    tile: SensorTile,
    flow: Flow,
    /// The index of the frame that was sent last.
    sent: Option<usize>,
}

impl<'a> StoredPage<'a> {
    /// Serves the page until its connection ends or `stop` is set.
    pub(crate) fn serve(
        set: &'a dyn DataSet,
        requests: &Receiver<String>,
        mut outbox: Outbox,
        stop: &AtomicBool,
    ) {
        let message = match set.frame(0) {
            Ok(frame) => {
                let mut page = StoredPage {
                    set,
                    outbox,
                    shown: Shown { index: 0, frame },
                    scene: None,
                    open_drive: String::new(),
                    selected: None,
                    state: Flow::default(),
                    is_changed: true,
                    tiles: Vec::new(),
                    due: None,
                };
                page.run(requests, stop);
                outbox = page.outbox;
                "the viewer has ended".to_owned()
            }
            Err(e) => e.to_string(),
        };
        outbox.text(&Reply::Ended { message });
    }

    fn run(&mut self, requests: &Receiver<String>, stop: &AtomicBool) {
        while !stop.load(Ordering::Acquire) && !self.outbox.is_full() {
            self.play_if_due();
            self.send();
            let due =
                self.due.map_or(LOOK_EVERY, |due| due.saturating_duration_since(Instant::now()));
            let mut next = requests.recv_timeout(due.min(LOOK_EVERY));
            while let Ok(text) = next {
                self.answer(&text);
                next = requests.try_recv().map_err(|_| RecvTimeoutError::Timeout);
            }
            if let Err(RecvTimeoutError::Disconnected) = next {
                break;
            }
        }
    }

    /// Shows the next frame if it is due. At the last frame, and at one that cannot be read, time stops.
    fn play_if_due(&mut self) {
        let Some(due) = self.due.filter(|due| *due <= Instant::now()) else { return };
        let before = self.shown.frame.sim_time;
        self.due = None;
        self.is_changed = true;
        if self.shown.index + 1 == self.set.frames() {
            return;
        }
        if let Err(e) = self.show(self.shown.index + 1) {
            self.refuse("play", &e.to_string());
            return;
        }
        let wait = self.shown.frame.sim_time.saturating_sub(before).min(SHOWN_MAX);
        // A late frame is not made up for.
        self.due = Some((due + wait).max(Instant::now()));
    }

    fn show(&mut self, index: usize) -> Result<(), ReadError> {
        self.shown = Shown { index, frame: self.set.frame(index)? };
        self.is_changed = true;
        Ok(())
    }

    fn send(&mut self) {
        if let Err(e) = self.send_scene() {
            self.refuse("scene", &e.to_string());
        }
        let now = Instant::now();
        for channel in 0..self.tiles.len() {
            if let Err(e) = self.send_tile(channel, now) {
                // Once for each frame: the next one may be whole.
                self.tiles[channel].sent = Some(self.shown.index);
                self.refuse("tiles", &e.to_string());
            }
        }
        if self.is_changed && self.state.is_open(now) {
            let playback = Playback {
                at: self.shown.index as f64,
                last: (self.set.frames() - 1) as f64,
                step: 1.0,
                unit: "frame",
            };
            let plays = self.due.is_some();
            let state = State::of_stored(&self.shown.frame, self.selected, plays, playback);
            if self.outbox.text(&state) {
                self.state.send(now);
                self.is_changed = false;
            }
        }
    }

    /// Says which scene this is, where it differs from the one before.
    fn send_scene(&mut self) -> Result<(), ReadError> {
        let number = self.set.scene_of(self.shown.index);
        if self.scene == Some(number) {
            return Ok(());
        }
        self.scene = Some(number);
        self.tiles.clear();
        let scene = self.set.scene(number)?;
        self.outbox.text(&Reply::Hello {
            source: "data_set",
            name: &scene.name,
            map: &scene.map,
            blueprints: Vec::new(),
            tag_colors: Tag::ALL.iter().map(|tag| tag.color()).collect(),
            sensors: &scene.sensors,
        });
        if scene.open_drive != self.open_drive {
            let network = Network::parse(&scene.open_drive)?;
            self.outbox.send(Message::binary(map::message(&network)));
            self.open_drive = scene.open_drive;
        }
        self.outbox.text(&Reply::Path { points_m: &scene.path_m });
        Ok(())
    }

    fn send_tile(&mut self, channel: usize, now: Instant) -> Result<(), ReadError> {
        let Tile { tile, flow, sent } = &mut self.tiles[channel];
        let Shown { index, frame } = &self.shown;
        if *sent == Some(*index) || !flow.is_open(now) {
            return Ok(());
        }
        let output = tile.output.name();
        let measured = self.set.measured(*index, &tile.sensor, output)?;
        let message = encode::stored(&measured, channel as u32, frame.frame)?;
        let boxes = frame.boxes.get(&tile.sensor).map_or(&[][..], Vec::as_slice);
        let boxes = boxes.iter().map(|b| BoxLine(b.id, b.tag, &b.name, b.visible_px)).collect();
        // The image follows at once: the page draws both together.
        self.outbox.text(&Reply::Boxes { channel: channel as u32, frame: frame.frame, boxes });
        if self.outbox.send(Message::binary(message)) {
            flow.send(now);
            *sent = Some(*index);
        }
        Ok(())
    }

    fn answer(&mut self, text: &str) {
        let request: Request = match serde_json::from_str(text) {
            Ok(request) => request,
            Err(e) => return self.refuse("unknown", &e.to_string()),
        };
        let (name, now) = (request.name(), Instant::now());
        match request {
            Request::Ack { channel: STATE_CHANNEL } => self.state.acknowledge(now),
            Request::Ack { channel } => {
                if let Some(tile) = self.tiles.get_mut(channel as usize) {
                    tile.flow.acknowledge(now);
                }
            }
            other => {
                self.is_changed = true;
                match self.perform(other) {
                    Ok(()) => drop(self.outbox.text(&Reply::Done { request: name, id: None })),
                    Err(e) => self.refuse(name, &e.to_string()),
                }
            }
        }
    }

    fn perform(&mut self, request: Request) -> Result<(), ReadError> {
        match request {
            Request::Sensors { tiles } => {
                if tiles.len() > TILES_MAX {
                    let count = tiles.len();
                    return Err(ViewError::Tiles { count, most: TILES_MAX }.into());
                }
                let new = |tile| Tile { tile, flow: Flow::default(), sent: None };
                self.tiles = tiles.into_iter().map(new).collect();
            }
            Request::Select { id } => self.selected = id,
            Request::Pause {} => self.due = None,
            Request::Step {} => {
                self.due = None;
                if self.shown.index + 1 == self.set.frames() {
                    return Err(ViewError::LastFrame.into());
                }
                self.show(self.shown.index + 1)?;
            }
            Request::Play {} => {
                if self.shown.index + 1 == self.set.frames() {
                    self.show(0)?;
                }
                self.due.get_or_insert_with(Instant::now);
            }
            Request::Seek { to } => {
                self.show((to.max(0.0) as usize).min(self.set.frames() - 1))?;
            }
            _ => return Err(ViewError::NoSimulator.into()),
        }
        Ok(())
    }

    fn refuse(&mut self, request: &'static str, why: &str) {
        self.outbox.text(&Reply::Error { request, message: why.to_owned() });
    }
}
