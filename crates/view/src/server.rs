//! The HTTP server, and the tasks between sockets and page threads.

use std::{
    net::{IpAddr, SocketAddr},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
        mpsc::{SyncSender, TrySendError, sync_channel},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};

use axum::{
    Router,
    body::Body,
    extract::{
        Request, State,
        ws::{Message, WebSocket, WebSocketUpgrade},
    },
    http::{HeaderMap, HeaderName, Response, StatusCode, header},
    middleware::{self, Next},
    response::IntoResponse,
    routing::{any, get},
};
use client_lib::{Client, ClientError, Deadlines, Frame, Strategy, Waiter};
use tokio::{net::TcpListener, runtime, sync::mpsc, time};

use crate::{
    ViewError, assets,
    data_set::DataSet,
    guard::{self, Pages},
    outbox::Outbox,
    page::Page,
    player::{Player, Recording},
    stored_page::StoredPage,
    stream::{MapScene, Queue, Received, SUBPROTOCOLS, Stream},
};

/// Pages and Foxglove connections that are open at a time; each is a client of the simulator, which has 32 places.
const PAGES_MAX: usize = 4;
/// Messages between a socket and its page thread, in each direction.
const QUEUE: usize = 64;
/// The longest request of a page in bytes.
const REQUEST_BYTES_MAX: usize = 64 << 10;
/// The path of the Foxglove WebSocket.
const FOXGLOVE: &str = "/foxglove";
/// How long a wait lasts before the server looks whether it is to end.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// No frame is later: a wait for one ends with the simulator.
const NEVER: Frame = Frame(u64::MAX - 1);
/// How long pages have to take the reason of the end.
const LAST_WORDS: Duration = Duration::from_secs(1);
/// For a frame that a page requests, and for outcomes: a page that waits for them shows nothing new.
const PATIENCE: Duration = Duration::from_secs(10);

/// What is shown.
#[derive(Clone)]
pub enum Source {
    /// The running simulator of this name; `None`: the only one that runs.
    Simulator(Option<String>),
    /// A recording.
    Recording(Recording),
    /// A data set.
    DataSet(Arc<dyn DataSet>),
}

/// What to show, and where.
#[derive(Clone)]
pub struct ViewOptions {
    /// What is shown.
    pub source: Source,
    /// The address to listen on.
    pub listen: IpAddr,
    /// The port; 0: any that is free.
    pub port: u16,
    /// Draws the map for Foxglove.
    pub map_scene: MapScene,
}

/// Why a viewer has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// It was stopped.
    Stopped,
    /// The simulator has ended.
    SimulatorEnded,
}

/// A viewer that listens.
pub struct Viewer {
    listener: std::net::TcpListener,
    address: SocketAddr,
    shared: Arc<Shared>,
    /// Of a simulator.
    waiter: Option<Waiter>,
    /// Keeps the place of a client, so that a full simulator is an error at the start.
    _client: Option<Client>,
}

/// What all pages share.
struct Shared {
    shown: Shown,
    map_scene: MapScene,
    listen: IpAddr,
    stop: AtomicBool,
    /// The threads of pages.
    threads: Mutex<Vec<JoinHandle<()>>>,
    /// The number of open sockets.
    sockets: AtomicUsize,
}

/// What every page shows.
enum Shown {
    /// A simulator, and the player of the recording that it replays.
    Simulator {
        instance: String,
        player: Option<Arc<Mutex<Player>>>,
    },
    DataSet(Arc<dyn DataSet>),
}

impl Shared {
    fn threads(&self) -> MutexGuard<'_, Vec<JoinHandle<()>>> {
        self.threads.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Starts the thread of a socket; returns the response if there is none.
    fn spawn(
        &self,
        name: &str,
        serve: impl FnOnce() + Send + 'static,
    ) -> Result<(), Box<Response<Body>>> {
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(serve);
        let mut threads = self.threads();
        threads.retain(|thread| !thread.is_finished());
        match thread {
            Ok(thread) => threads.push(thread),
            Err(e) => {
                let why = format!("thread: {e}\n");
                return Err(Box::new(assets::text(StatusCode::SERVICE_UNAVAILABLE, why)));
            }
        }
        Ok(())
    }
}

impl Viewer {
    /// Connects to the simulator and listens.
    ///
    /// # Errors
    ///
    /// [`ViewError`]: there is no such simulator, or the address cannot be listened on.
    pub fn start(options: &ViewOptions) -> Result<Viewer, ViewError> {
        let address = SocketAddr::new(options.listen, options.port);
        let listen = || {
            let listener = std::net::TcpListener::bind(address)?;
            listener.set_nonblocking(true)?;
            Ok((listener.local_addr()?, listener))
        };
        let (address, listener) =
            listen().map_err(|source| ViewError::Listen { address, source })?;
        let (shown, waiter, client) = match &options.source {
            Source::Simulator(instance) => {
                let mut client = Client::connect(instance.as_deref(), "view")?;
                let waiter = client.observer().waiter();
                let instance = client.instance().id().to_owned();
                (Shown::Simulator { instance, player: None }, Some(waiter), Some(client))
            }
            Source::Recording(recording) => {
                let mut client = connect(&recording.instance)?;
                let waiter = client.observer().waiter();
                let player = Some(Arc::new(Mutex::new(Player::start(client, recording)?)));
                let instance = recording.instance.clone();
                (Shown::Simulator { instance, player }, Some(waiter), None)
            }
            Source::DataSet(set) => (Shown::DataSet(Arc::clone(set)), None, None),
        };
        let shared = Arc::new(Shared {
            shown,
            map_scene: options.map_scene,
            listen: options.listen,
            stop: AtomicBool::new(false),
            threads: Mutex::default(),
            sockets: AtomicUsize::new(0),
        });
        Ok(Viewer { listener, address, shared, waiter, _client: client })
    }

    /// The name of the simulator; `None` of a data set.
    #[must_use]
    pub fn instance(&self) -> Option<&str> {
        match &self.shared.shown {
            Shown::Simulator { instance, .. } => Some(instance),
            Shown::DataSet(_) => None,
        }
    }

    /// The address that it listens on.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Serves pages until `stop` is set or the simulator ends.
    ///
    /// # Errors
    ///
    /// [`ViewError::Server`].
    pub fn run(self, stop: &AtomicBool) -> Result<Ended, ViewError> {
        let runtime = runtime::Builder::new_current_thread().enable_all().build()?;
        let shared = Arc::clone(&self.shared);
        let router = Router::new()
            .route("/socket", get(open_page))
            .route(FOXGLOVE, get(open_stream))
            .fallback(any(|request: Request| async move { assets::response(request.uri().path()) }))
            .layer(middleware::from_fn_with_state(Arc::clone(&shared), check))
            .with_state(Arc::clone(&shared));
        let ended = runtime.block_on(async {
            let listener = TcpListener::from_std(self.listener)?;
            let serving = tokio::spawn(axum::serve(listener, router).into_future());
            let ended = loop {
                if stop.load(Ordering::Acquire) {
                    break Ended::Stopped;
                }
                let waiter = self.waiter.as_ref();
                if waiter.is_some_and(|waiter| waiter.next_frame(NEVER, Duration::ZERO).is_err()) {
                    break Ended::SimulatorEnded;
                }
                time::sleep(LOOK_EVERY).await;
            };
            // The page threads end, then their sockets; a stalled one is not waited for. The end of the
            // simulator is seen by the threads themselves, which tell their pages.
            shared.stop.store(ended == Ended::Stopped, Ordering::Release);
            let begin = Instant::now();
            while shared.sockets.load(Ordering::Acquire) > 0 && begin.elapsed() < LAST_WORDS {
                time::sleep(Duration::from_millis(10)).await;
            }
            serving.abort();
            Ok::<Ended, ViewError>(ended)
        });
        drop(runtime);
        let threads = std::mem::take(&mut *self.shared.threads());
        for thread in threads {
            // A panic there is a panic here.
            thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        }
        ended
    }
}

/// Refuses requests that are not of the viewer's own page.
async fn check(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response<Body> {
    let checked = {
        let header = |name| text_of(request.headers(), name);
        let pages = if request.uri().path() == FOXGLOVE { Pages::Foxglove } else { Pages::Own };
        guard::check(shared.listen, header(header::HOST), header(header::ORIGIN), pages)
    };
    match checked {
        Ok(()) => next.run(request).await,
        Err(why) => assets::text(StatusCode::FORBIDDEN, format!("{why}\n")),
    }
}

/// Returns a header as text; what is not ASCII is no name that this server has.
fn text_of(headers: &HeaderMap, name: HeaderName) -> Option<&str> {
    headers.get(name).map(|value| value.to_str().unwrap_or("?"))
}

/// Counts a socket for as long as it lives.
struct OpenSocket(Arc<Shared>);

impl OpenSocket {
    /// `None` if as many are open as may be.
    fn count(shared: &Arc<Shared>) -> Option<OpenSocket> {
        let more = |open| (open < PAGES_MAX).then_some(open + 1);
        let counted = shared.sockets.fetch_update(Ordering::AcqRel, Ordering::Acquire, more);
        counted.ok().map(|_| OpenSocket(Arc::clone(shared)))
    }
}

impl Drop for OpenSocket {
    fn drop(&mut self) {
        self.0.sockets.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Opens the WebSocket of a page, with a client of the simulator and a thread of its own.
async fn open_page(State(shared): State<Arc<Shared>>, upgrade: WebSocketUpgrade) -> Response<Body> {
    let Some(open) = OpenSocket::count(&shared) else { return full() };
    let (requests, received) = sync_channel(QUEUE);
    let (outbox, messages) = mpsc::channel(QUEUE);
    let outbox = Outbox::new(outbox);
    // It connects in its thread: that may wait for the host.
    let serve = {
        let shared = Arc::clone(&shared);
        move || match &shared.shown {
            Shown::DataSet(set) => StoredPage::serve(&**set, &received, outbox, &shared.stop),
            Shown::Simulator { instance, player } => match connect(instance) {
                Ok(client) => {
                    Page::serve(client, player.clone(), &received, outbox, &shared.stop);
                }
                Err(e) => Page::refuse_all(outbox, &e),
            },
        }
    };
    if let Err(refusal) = shared.spawn("view-page", serve) {
        return *refusal;
    }
    upgrade
        .max_message_size(REQUEST_BYTES_MAX)
        .on_upgrade(move |socket| carry(socket, requests, messages, open))
        .into_response()
}

/// Opens the Foxglove WebSocket, with a client of the simulator and a thread of its own.
async fn open_stream(
    State(shared): State<Arc<Shared>>,
    upgrade: WebSocketUpgrade,
) -> Response<Body> {
    let upgrade = upgrade.protocols(SUBPROTOCOLS);
    if upgrade.selected_protocol().is_none() {
        let why = format!("offer one of the subprotocols {}\n", SUBPROTOCOLS.join(", "));
        return assets::text(StatusCode::BAD_REQUEST, why);
    }
    let Some(open) = OpenSocket::count(&shared) else { return full() };
    let (requests, received) = sync_channel(QUEUE);
    let queue = Arc::new(Queue::default());
    let serve = {
        let (shared, queue) = (Arc::clone(&shared), Arc::clone(&queue));
        move || match &shared.shown {
            Shown::DataSet(_) => Stream::refuse_all(&queue, NO_DATA_SET),
            Shown::Simulator { instance, player } => match connect(instance) {
                Ok(client) => {
                    let (player, stop) = (player.clone(), &shared.stop);
                    Stream::serve(client, player, shared.map_scene, &received, &queue, stop);
                }
                Err(e) => Stream::refuse_all(&queue, &e.to_string()),
            },
        }
    };
    if let Err(refusal) = shared.spawn("view-foxglove", serve) {
        return *refusal;
    }
    upgrade
        .max_message_size(REQUEST_BYTES_MAX)
        .on_upgrade(move |socket| carry_stream(socket, requests, queue, open))
        .into_response()
}

/// Why a data set is not served to Foxglove.
const NO_DATA_SET: &str = "a data set is not sent live; omnibus export DIR --format mcap makes a file of \
                           it that Foxglove opens";

/// Says that as many sockets are open as may be.
fn full() -> Response<Body> {
    let why = format!("{PAGES_MAX} pages are open; close one\n");
    assets::text(StatusCode::SERVICE_UNAVAILABLE, why)
}

fn connect(instance: &str) -> Result<Client, ClientError> {
    let deadlines = Deadlines::default().with_answer(PATIENCE).with_frame(Some(PATIENCE));
    // It spins for nothing: a screen shows a frame for 16 ms.
    let options = Client::options("view").instance(instance).wait_strategy(Strategy::BATCH);
    options.deadlines(deadlines).connect()
}

/// Carries messages between a socket and its page thread until one of them ends.
async fn carry(
    mut socket: WebSocket,
    requests: SyncSender<String>,
    mut messages: mpsc::Receiver<Message>,
    _open: OpenSocket,
) {
    loop {
        tokio::select! {
            message = messages.recv() => match message {
                Some(message) => if socket.send(message).await.is_err() { return },
                None => break,
            },
            request = socket.recv() => {
                let Some(Ok(request)) = request else { return };
                let Message::Text(text) = request else { continue };
                pass_on(&requests, text.as_str().to_owned()).await;
            }
        }
    }
    let _ = socket.send(Message::Close(None)).await;
}

/// Carries messages between a Foxglove WebSocket and its thread until one of them ends.
async fn carry_stream(
    mut socket: WebSocket,
    requests: SyncSender<Received>,
    queue: Arc<Queue>,
    _open: OpenSocket,
) {
    loop {
        tokio::select! {
            message = queue.next() => match message {
                Some(message) => if socket.send(message).await.is_err() { return },
                None => break,
            },
            request = socket.recv() => {
                let Some(Ok(request)) = request else { return };
                match request {
                    Message::Text(text) => {
                        pass_on(&requests, Received::Text(text.as_str().to_owned())).await;
                    }
                    Message::Binary(_) => pass_on(&requests, Received::Binary).await,
                    _ => {}
                }
            }
        }
    }
    let _ = socket.send(Message::Close(None)).await;
}

/// Passes a request on to a thread; if that is busy, the socket waits.
async fn pass_on<T>(requests: &SyncSender<T>, mut request: T) {
    while let Err(TrySendError::Full(back)) = requests.try_send(request) {
        request = back;
        time::sleep(Duration::from_millis(5)).await;
    }
}
