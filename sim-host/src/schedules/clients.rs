//! Clients: one ticks, sends commands and causes faults; others take part in the barrier, or die.

use std::{
    collections::{BTreeMap, BTreeSet},
    rc::Rc,
    sync::atomic::Ordering,
};

use bus::{BundleSample, ClientPorts, Ending, Instance, Participant, Reader, Role, scheduler};
use protocol::{
    ActorId, BatchHeader, BundleHeader, BundleId, Command, CreateBundle, Frame, JournalEntry,
    LoadMap, Name, Page, RawCommand, SensorSpec, Settings, Shape, TrafficParam, Weather, output,
    param, sensor, shape, status,
};

use super::Shared;

/// Longest time for an answer or a frame. Nanoseconds.
const ANSWER_NANOS: u64 = 20_000_000_000;

/// Frames that the last phase has at least.
const LAST_FRAMES: u64 = 3;

/// Entries of a flood: more parts than the journal's channel has room for come of one in each frame.
const FLOOD_FRAMES: u64 = 90;

/// Starts the clients of a schedule.
pub(super) fn start(shared: &Rc<Shared>) {
    let plan = &shared.plan;
    let members: Vec<u32> = (0..plan.members)
        .map(|index| {
            let shared = Rc::clone(shared);
            scheduler::spawn("member", move || member(&shared, index))
        })
        .collect();
    let mortals = (0..plan.mortals).map(|index| {
        let shared = Rc::clone(shared);
        let pid = scheduler::spawn("mortal", move || mortal(&shared, index));
        scheduler::kill(pid, scheduler::random(600));
        pid
    });
    let others: Vec<u32> = members.iter().copied().chain(mortals).collect();
    if plan.visitors > 0 {
        start_visitor(shared, plan.visitors);
    }
    let shared = Rc::clone(shared);
    scheduler::spawn("driver", move || Driver::new(&shared).run(&others));
}

/// A client that the barrier waits for.
fn member(shared: &Shared, index: u64) {
    let name = Name::new(&format!("member-{index}"));
    let participant = Participant::join(&Instance, Role::Client, name, None, true).unwrap();
    let ports = ClientPorts::open(participant.node().unwrap()).unwrap();
    participant.ready().unwrap();
    let control = participant.control();
    participant.words().request_barrier(true);
    control.host.notify();
    let is_in = || participant.words().in_barrier().then_some(());
    participant.await_answer(scheduler::now_nanos() + ANSWER_NANOS, is_in).unwrap();
    let mut done = participant.words().ack();
    while !shared.is_ending.get() {
        let Ok(newest) = participant.next_frame(done, None) else { break };
        while ports.snapshot.receive().unwrap().is_some() {}
        if !shared.plan.may_be_late() && !shared.plan.modes {
            let complete = control.complete.get();
            assert!(complete < newest.0, "{newest} is complete without {name:?}");
        }
        done = newest;
        participant.arrive(newest);
    }
    drop(ports);
}

/// Starts a client that joins and leaves, and is followed by another one.
fn start_visitor(shared: &Rc<Shared>, left: u64) {
    let shared = Rc::clone(shared);
    shared.visitors_left.set(left);
    scheduler::spawn("visitor", move || {
        let name = Name::new(&format!("visitor-{left}"));
        let participant = Participant::join(&Instance, Role::Client, name, None, true).unwrap();
        let ports = ClientPorts::open(participant.node().unwrap()).unwrap();
        participant.ready().unwrap();
        participant.words().request_barrier(scheduler::random(2) == 0);
        participant.control().host.notify();
        assert_eq!(participant.words().name(), name, "another process has the slot");
        drop((ports, participant));
        if left > 1 {
            start_visitor(&shared, left - 1);
        } else {
            shared.visitors_left.set(0);
        }
    });
}

/// A client that takes the tick, sends a command, requests a frame and takes part in the barrier until
/// it is killed.
fn mortal(shared: &Shared, index: u64) {
    let name = Name::new(&format!("mortal-{index}"));
    let participant = Participant::join(&Instance, Role::Client, name, None, true).unwrap();
    let ports = ClientPorts::open(participant.node().unwrap()).unwrap();
    participant.ready().unwrap();
    let control = participant.control();
    let mut sequence = 0;
    while !shared.is_ending.get() {
        if scheduler::random(2) == 0 && control.pass_tick(None, Some(participant.slot())) {
            let frame = Frame(control.complete.get().max(control.tick.get())).next();
            if control.is_synchronous() {
                control.request(participant.slot(), frame);
            }
            scheduler::point("requested");
            control.pass_tick(Some(participant.slot()), None);
        }
        let header = BatchHeader { client: name, sequence, now: 1, ..BatchHeader::default() };
        let commands = [create_bundle(), sensor()].map(RawCommand::from);
        ports.command.send(header, &commands).unwrap();
        control.host.notify();
        sequence += 2;
        participant.words().request_barrier(scheduler::random(2) == 0);
        let done = participant.words().ack();
        let deadline = scheduler::now_nanos() + 1_000_000;
        if let Ok(frame) = participant.next_frame(done, Some(deadline)) {
            participant.arrive(frame);
        }
    }
    drop(ports);
}

fn create_bundle() -> Command {
    let name = Name::new("bundle");
    Command::CreateBundle(CreateBundle {
        sensor_count: 1,
        max_borrowed: 2,
        name,
        ..CreateBundle::default()
    })
}

fn sensor() -> Command {
    Command::Sensor(SensorSpec {
        name: Name::new("front"),
        kind: sensor::CAMERA,
        outputs: output::DEPTH,
        width: 4,
        height: 4,
        fov_rad: 1.5,
        ..SensorSpec::default()
    })
}

/// The client that ticks.
struct Driver<'a> {
    shared: &'a Shared,
    participant: Participant,
    ports: ClientPorts,
    name: Name,
    /// Sequence number of the next command.
    sent: u64,
    /// Those without an outcome yet.
    unanswered: BTreeSet<u64>,
    /// Each with the newest frame when it was opened, after which it must have measurements.
    bundles: BTreeMap<BundleId, (Reader<BundleHeader, Page>, u64)>,
}

impl Driver<'_> {
    fn new(shared: &Shared) -> Driver<'_> {
        let name = Name::new("driver");
        let participant = Participant::join(&Instance, Role::Client, name, None, true).unwrap();
        let ports = ClientPorts::open(participant.node().unwrap()).unwrap();
        participant.ready().unwrap();
        let bundles = BTreeMap::new();
        Driver { shared, participant, ports, name, sent: 0, unanswered: BTreeSet::new(), bundles }
    }

    fn run(mut self, others: &[u32]) {
        let plan = &self.shared.plan;
        let began_idle = scheduler::idle_nanos();
        for _ in 0..plan.frames {
            self.cause_fault(others);
            self.send_some();
            if plan.modes && scheduler::random(3) == 0 {
                self.run_asynchronously();
            } else {
                self.tick();
            }
        }
        self.shared.kills_left.set(0);
        scheduler::spare_all();
        self.shared.is_ending.set(true);
        let mut left = LAST_FRAMES;
        let shared = self.shared;
        let has_others =
            || shared.visitors_left.get() > 0 || others.iter().any(|pid| scheduler::lives(*pid));
        while left > 0 || has_others() {
            self.tick();
            left = left.saturating_sub(1);
        }
        self.set(Settings { pipeline: 0, ..self.shared.plan.settings });
        // A stage that was stopped may be late for longer than the frames until here.
        while !self.tick() {}
        if !self.shared.may_idle.get() {
            let idle = scheduler::idle_nanos() - began_idle;
            assert_eq!(idle, 0, "all processes slept although there was something to do");
        }
        self.leave();
    }

    /// Leaves, and stops the host when it has noticed.
    fn leave(self) {
        let Driver { shared, participant, ports, bundles, .. } = self;
        let control = participant.control().clone();
        let slot = participant.slot();
        control.pass_tick(Some(slot), None);
        drop((ports, bundles));
        drop(participant);
        let deadline = scheduler::now_nanos() + ANSWER_NANOS;
        while control.slots()[2..].iter().any(|slot| slot.state() != bus::SlotState::Free) {
            assert!(scheduler::now_nanos() < deadline, "a slot is not freed");
            scheduler::sleep(1_000_000);
        }
        shared.stop.store(true, Ordering::Release);
        control.host.notify();
    }

    fn cause_fault(&self, others: &[u32]) {
        let Shared { plan, kills_left, stages, .. } = self.shared;
        let victim = stages.borrow()[scheduler::random(2) as usize];
        if kills_left.get() > 0 && scheduler::random(2) == 0 {
            kills_left.set(kills_left.get() - 1);
            scheduler::kill(victim, scheduler::random(400));
        } else if plan.stops && scheduler::random(2) == 0 {
            let count = stages.borrow().len() + others.len();
            let at = scheduler::random(count as u64) as usize;
            let victim = stages.borrow().iter().chain(others).copied().nth(at).unwrap_or(victim);
            scheduler::stop(victim, 1000 << scheduler::random(14));
        }
    }

    /// Sends a few commands of any kind.
    fn send_some(&mut self) {
        let mut commands = Vec::new();
        let number = self.sent as f32;
        let actor_id = ActorId(7);
        for _ in 0..scheduler::random(4) {
            match scheduler::random(7) {
                0 => commands
                    .push(Command::SetWeather(Weather { wetness: number, ..Weather::default() })),
                1 => commands.push(Command::TrafficParam(TrafficParam {
                    actor_id,
                    param: param::GAP_M,
                    value: number,
                })),
                2 | 3 => commands.push(Command::TrafficParam(TrafficParam {
                    actor_id,
                    param: param::CHANGE_NOW,
                    value: number,
                })),
                4 => {
                    let life_nanos = scheduler::random(6_000_000);
                    commands.push(Command::Draw(Shape { life_nanos, ..Shape::new(shape::POINT) }));
                }
                5 => commands.extend([create_bundle(), sensor()]),
                _ => commands
                    .extend(self.bundles.keys().next().map(|id| Command::DestroyBundle(*id))),
            }
        }
        if self.shared.plan.maps && scheduler::random(4) == 0 {
            commands.push(Command::LoadMap(LoadMap::default()));
        }
        if scheduler::random(40) == 0 {
            let param = TrafficParam { actor_id, param: param::CHANGE_NOW, value: number };
            commands.extend(std::iter::repeat_n(Command::TrafficParam(param), 150));
        }
        if !commands.is_empty() {
            let now = scheduler::random(2) == 0;
            self.send(&commands, now);
            if now {
                self.await_outcomes();
            }
        }
    }

    fn send(&mut self, commands: &[Command], now: bool) {
        let header = BatchHeader {
            client: self.name,
            sequence: self.sent,
            now: now.into(),
            ..BatchHeader::default()
        };
        let raw: Vec<RawCommand> = commands.iter().copied().map(RawCommand::from).collect();
        self.ports.command.send(header, &raw).unwrap();
        let end = self.sent + raw.len() as u64;
        self.unanswered.extend(self.sent..end);
        self.sent = end;
        if now {
            self.participant.control().host.notify();
        }
    }

    /// Waits until all commands are answered.
    fn await_outcomes(&mut self) {
        assert!(self.are_answered_within(ANSWER_NANOS), "no outcome of {:?}", self.unanswered);
    }

    /// Waits until all commands are answered, and returns whether they are.
    fn are_answered_within(&mut self, nanos: u64) -> bool {
        let Driver { participant, ports, name, unanswered, bundles, .. } = self;
        let deadline = scheduler::now_nanos() + nanos;
        let look = || {
            let lost = ports.outcomes.receive(|_, entry: &JournalEntry| {
                if entry.client != *name {
                    return;
                }
                assert!(unanswered.remove(&entry.sequence), "{} ended twice", entry.sequence);
                if entry.outcome.status != status::DONE {
                    return;
                }
                let id = BundleId(entry.outcome.id);
                match entry.command.decode() {
                    Some(Command::Sensor(_)) => {
                        if let Ok(reader) = ports.bundles.open(id) {
                            bundles.insert(id, (reader, participant.control().tick.get()));
                        }
                    }
                    Some(Command::DestroyBundle(id)) => drop(bundles.remove(&id)),
                    Some(Command::LoadMap(_)) => bundles.clear(),
                    _ => {}
                }
            });
            assert!(!lost.unwrap(), "outcomes were lost");
            unanswered.is_empty().then_some(())
        };
        participant.await_answer(deadline, look).is_ok()
    }

    fn set(&mut self, settings: Settings) {
        self.send(&[Command::SetSettings(settings)], true);
        self.await_outcomes();
    }

    /// Lets the world run on its own for some frames, with commands in many of them.
    fn run_asynchronously(&mut self) {
        let plan = &self.shared.plan;
        self.set(Settings { synchronous: 0, ..plan.settings });
        let is_flood = plan.flood && plan.settings.real_time_permille == 0;
        let frames = if is_flood { FLOOD_FRAMES } else { scheduler::random(6) };
        if is_flood {
            let victim = self.shared.stages.borrow()[scheduler::random(2) as usize];
            scheduler::stop(victim, 4_000_000);
        }
        let mut done = self.participant.words().ack();
        for _ in 0..frames {
            done = self.participant.next_frame(done, None).unwrap();
            let value = self.sent as f32;
            let param = TrafficParam { actor_id: ActorId(7), param: param::CHANGE_NOW, value };
            self.send(&[Command::TrafficParam(param)], true);
            self.await_outcomes();
        }
        self.set(plan.settings);
    }

    /// Requests a frame and waits for it. Returns it if all participants have arrived at it.
    fn request(&mut self) -> Option<Frame> {
        let own = self.participant.slot();
        let control = self.participant.control();
        while control.ticker() != Some(own) && !control.pass_tick(None, Some(own)) {
            // Another client has the tick.
            scheduler::sleep(100_000);
        }
        let frame = Frame(control.complete.get().max(control.tick.get())).next();
        control.request(own, frame);
        let deadline = scheduler::now_nanos() + ANSWER_NANOS;
        let ending = self.participant.await_complete(frame, Some(deadline));
        scheduler::note(|| format!("{frame} ended: {ending:?}"));
        match ending {
            Ok(Ending::Complete) => {
                self.shared.truth.borrow_mut().check_complete(frame);
                return Some(frame);
            }
            Ok(Ending::Late(_)) => assert!(self.shared.plan.may_be_late(), "{frame} is late"),
            Ok(Ending::Degraded(_)) => {
                assert!(self.shared.plan.mortals > 0, "{frame} is degraded, and no client died");
            }
            Err(why) => panic!("{frame} does not end: {why:?}"),
        }
        None
    }

    /// Advances the world by a frame, in which all commands are carried out. Returns whether every
    /// participant has arrived at it.
    fn tick(&mut self) -> bool {
        let complete = self.request();
        if self.shared.plan.may_be_overtaken() {
            while !self.are_answered_within(1_000_000) {
                self.request();
            }
        }
        // A frame that ended has the outcomes of its commands.
        assert!(self.are_answered_within(0), "no outcome of {:?}", self.unanswered);
        if let Some(frame) = complete {
            self.collect(frame);
        }
        while self.ports.snapshot.receive().unwrap().is_some() {}
        complete.is_some()
    }

    /// Checks that every bundle has the measurement of `frame`.
    fn collect(&mut self, frame: Frame) {
        if self.shared.plan.settings.pipeline > 0 {
            return;
        }
        for (id, (reader, opened_at)) in &self.bundles {
            let newest = std::iter::from_fn(|| reader.receive().unwrap()).last();
            let newest = newest.map(|sample: BundleSample| sample.header().stamp.frame);
            assert!(
                frame.0 <= *opened_at || newest >= Some(frame),
                "bundle {} at {frame}: {newest:?}",
                id.0
            );
        }
    }
}
