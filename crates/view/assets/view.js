// The page of `omnibus view`: what the server sends, to the parts that show it; what is clicked, to the
// server.

import { Connection, MAP, STATE_CHANNEL } from "/connection.js";
import { WeatherControls, showDetails } from "/controls.js";
import { Driver } from "/drive.js";
import { MapView } from "/map.js";
import { Tiles } from "/tiles.js";
import { drawTimeline } from "/timeline.js";

const at = (id) => document.getElementById(id);
let state = null, isNew = false, seeking = null, sought = -1e9;

const say = (text) => { at("message").textContent = text; };
const send = (message) => connection.send(message);

at("foxglove").textContent = `ws://${location.host}/foxglove`;

const map = new MapView(at("map"), (id) => send({ type: "select", id }));
const connection = new Connection({ text: read, binary: take, closed });
const tiles = new Tiles(at("tiles"), connection);
const weather = new WeatherControls(at("weather"), send);
const driver = new Driver(send, at("pedals"));

function read(message) {
  if (message.type === "state") {
    [state, isNew] = [message, true];
  } else if (message.type === "hello") {
    document.body.dataset.source = message.source;
    at("title").textContent = `${message.name} · ${message.map}`;
    document.title = `${message.name} · Omnibus`;
    map.extents = tiles.extents = message.blueprints.map(([, extents]) => extents);
    const vehicles = message.blueprints.map(([id]) => id).filter((id) => id.startsWith("vehicle."));
    at("blueprint").replaceChildren(...vehicles.sort().map((id) => new Option(id.slice(8), id)));
    at("blueprint").value = "vehicle.tesla.model3";
    const isStored = message.source === "data_set";
    weather.canChange = !isStored;
    at("timeline").hidden = at("foxglove").parentElement.hidden = isStored;
    map.path = [];
    tiles.begin(message.tag_colors, isStored ? message.sensors : null);
  } else if (message.type === "path") {
    map.path = message.points_m;
  } else if (message.type === "boxes") {
    tiles.keepBoxes(message);
  } else if (message.type === "error") {
    say(`${message.request}: ${message.message}`);
  } else if (message.type === "done" && !/^(tiles|sensors)$/.test(message.request)) {
    say("");
    if (message.request === "spawn") send({ type: "select", id: message.id });
  }
}

function take(kind, channel, frame, bytes) {
  if (kind === MAP) map.load(bytes);
  else tiles.show(kind, channel, frame, bytes);
}

function closed(why) {
  say(`${why}; reload the page when a viewer runs again`);
  for (const button of document.querySelectorAll("button")) button.disabled = true;
}

// Which part of a recording is shown, or which client lets time pass.
function showTime({ playback, pace, holds_tick, holder, plays }) {
  const slider = at("seek");
  slider.hidden = !playback;
  if (!playback) {
    const ticker = holds_tick ? "this page" : holder;
    at("tick").textContent = pace.replace("_", " ") + (ticker ? ` · ${ticker} holds the tick` : "");
    return;
  }
  const where = playback.unit === "s"
    ? `${playback.at.toFixed(2)} of ${playback.last.toFixed(2)} s` : `${playback.at + 1} of ${playback.last + 1}`;
  at("tick").textContent = `${where}${plays ? "" : " · paused"}`;
  Object.assign(slider, { max: playback.last, step: playback.step });
  // What was moved just now is on its way.
  if (!seeking && performance.now() - sought > 500) slider.value = playback.at;
}

function show() {
  requestAnimationFrame(show);
  if (isNew) {
    isNew = false;
    connection.acknowledge(STATE_CHANNEL);
    at("clock").textContent = `frame ${state.frame} · ${state.sim_time_s.toFixed(2)} s`;
    showTime(state);
    at("pause").disabled = (state.playback || state.holds_tick) && !state.plays;
    at("play").disabled = state.plays || (state.pace !== "synchronous");
    at("step").disabled = state.playback && state.playback.at >= state.playback.last;
    at("destroy").disabled = !state.selected;
    const ego = state.actors.find(([id]) => id === state.ego);
    at("autopilot").disabled = !ego;
    at("autopilot").checked = ego?.[8] === 1;
    if (ego && map.followed === null && driver.ego !== state.ego) {
      [map.followed, map.metersWide] = [state.ego, 120];
    }
    driver.follow(ego ? state.ego : null);
    weather.follow(state.weather);
    showDetails(at("details"), state.selected);
    drawTimeline(at("timeline"), state.timeline);
    tiles.follow(state, map.marker ?? map.middle ?? [0, 0]);
  }
  map.draw(state);
}
requestAnimationFrame(show);

// At most ten a second while the slider moves.
at("seek").oninput = () => {
  seeking ??= setTimeout(() => {
    [seeking, sought] = [null, performance.now()];
    send({ type: "seek", to: Number(at("seek").value) });
  }, 100);
};
for (const name of ["pause", "step", "play"]) at(name).onclick = () => send({ type: name });
at("boxes").onchange = (event) => { tiles.showsBoxes = event.target.checked; };
at("destroy").onclick = () => send({ type: "destroy", id: state.selected.id });
at("autopilot").onchange = (event) => {
  send({ type: "autopilot", on: event.target.checked });
  event.target.blur();
};
const spawn = (choice) => {
  const near_m = map.marker ?? (state ? map.center : null);
  send({ type: "spawn", blueprint: at("blueprint").value, near_m, ...choice });
  // Keys drive, and do not press the button again.
  document.activeElement.blur();
};
at("spawn-ego").onclick = () => spawn({ ego: true });
at("spawn-traffic").onclick = () => spawn({ autopilot: true });
