// Pictures of cameras and lidars, each with what it shows, what carries it, and from where.

import { IMAGE } from "/connection.js";
import { PointView } from "/points.js";

const OUTPUTS = { color: "colour", depth: "depth", tags: "tags", instances: "instances", lidar: "lidar" };
// What a tile of a data set shows first.
const STORED_TILES = 3;
const CARRIERS = { auto: "own or first vehicle", selected: "selected actor", world: "the marker" };
// Position in the space of the carrier (metres), yaw, pitch (radians, positive looks down), by the half
// extents of the carrier: outside of it, whatever its size.
const VIEWS = {
  chase: ([x, , z]) => [[-x - 4.7, 0, 2 * z + 1.75], 0, 0.2],
  front: ([x, , z]) => [[0.5 * x, 0, 2 * z + 0.25], 0, 0.05],
  rear: ([x, , z]) => [[-0.6 * x, 0, 2 * z + 0.25], Math.PI, 0.05],
  left: ([, y, z]) => [[0, 0.6 * y, 2 * z + 0.25], Math.PI / 2, 0.1],
  right: ([, y, z]) => [[0, -0.6 * y, 2 * z + 0.25], -Math.PI / 2, 0.1],
  above: ([, , z]) => [[0, 0, 2 * z + 33], 0, Math.PI / 2],
};
const lidarPlace = ([, , z]) => [[0, 0, 2 * z + 0.95], 0, 0];
// Half extents of a car.
const CAR = [2.4, 0.95, 0.73];
const SIZES = { "320 × 180": [320, 180], "640 × 360": [640, 360], "1280 × 720": [1280, 720] };
const LIDAR_SIZE = [720, 32];
const FOV_RAD = Math.PI / 2;
// What stands at the marker looks north-east and down from here.
const WORLD_VIEW = [[-25, -25, 30], Math.PI / 4, 0.7];

const isPng = (buffer) => new Uint8Array(buffer, 0, 1)[0] === 0x89;

export class Tiles {
  constructor(parent, connection) {
    this.parent = parent;
    this.connection = connection;
    this.list = [];
    this.requested = null;
    this.tagColors = [];
    // By blueprint: half extents.
    this.extents = [];
    this.sensors = null;
    this.showsBoxes = true;
    const add = document.createElement("button");
    add.textContent = "Add a camera";
    add.onclick = () => {
      if (this.list.length >= 8) return;
      if (this.sensors) this.addStored(Object.keys(this.sensorChoices())[0]);
      else this.add("color", "front");
    };
    parent.append(this.adder = add);
  }

  // `sensors` of a data set: pairs of a name and its outputs.
  begin(tagColors, sensors) {
    this.tagColors = tagColors;
    this.requested = null;
    if (sensors) {
      this.beginStored(sensors);
      return;
    }
    if (!this.list.length) {
      this.add("color", "chase");
      this.add("lidar", "front");
    }
  }

  // The tiles of the scene before stay if this one has their sensors.
  beginStored(sensors) {
    const isOther = JSON.stringify(sensors) !== JSON.stringify(this.sensors);
    this.sensors = sensors;
    if (!isOther) return;
    for (const tile of this.list.splice(0)) tile.box.remove();
    const choices = Object.keys(this.sensorChoices());
    const lidar = choices.filter((choice) => choice.endsWith("/lidar")).slice(0, 1);
    const colors = choices.filter((choice) => choice.endsWith("/color"));
    for (const choice of [...colors.slice(0, STORED_TILES - lidar.length), ...lidar]) this.addStored(choice);
  }

  // `front/color` and the like, by what a person reads.
  sensorChoices() {
    return Object.fromEntries(this.sensors.flatMap(([name, outputs]) =>
      outputs.map((output) => [`${name}/${output}`, outputs.length > 1 ? `${name} · ${OUTPUTS[output]}` : name])));
  }

  addStored(choice) {
    const tile = this.frame();
    tile.source = this.choose(tile, this.sensorChoices(), choice, () => this.prepare(tile));
    this.finish(tile);
  }

  frame() {
    const box = document.createElement("div");
    box.className = "tile";
    const bar = document.createElement("div");
    bar.className = "bar";
    return { box, bar, images: 0, rate: 0, since: performance.now() };
  }

  choose(tile, options, value, onChange) {
    const select = document.createElement("select");
    for (const [key, name] of Object.entries(options)) select.add(new Option(name, key));
    select.value = value;
    select.onchange = onChange ?? (() => {});
    tile.bar.append(select);
    return select;
  }

  add(output, view) {
    const tile = this.frame(), choose = (...choice) => this.choose(tile, ...choice);
    const names = (object) => Object.fromEntries(Object.keys(object).map((key) => [key, key]));
    tile.output = choose(OUTPUTS, output, () => this.prepare(tile));
    tile.carrier = choose(CARRIERS, "auto");
    tile.view = choose(names(VIEWS), view);
    tile.size = choose(names(SIZES), "640 × 360");
    this.finish(tile);
  }

  finish(tile) {
    const { box, bar } = tile;
    tile.colors = this.choose(tile, { height: "height", tag: "tags" }, "tag", () => this.color(tile));
    tile.label = document.createElement("span");
    const close = document.createElement("button");
    close.textContent = "×";
    close.title = "Remove";
    close.onclick = () => {
      this.list.splice(this.list.indexOf(tile), 1);
      box.remove();
    };
    bar.append(tile.label, close);
    box.append(bar);
    this.parent.insertBefore(box, this.adder);
    this.list.push(tile);
    this.prepare(tile);
  }

  // A canvas has either images or WebGL for as long as it lives.
  prepare(tile) {
    tile.canvas?.remove();
    tile.canvas = document.createElement("canvas");
    tile.box.append(tile.canvas);
    const isLidar = this.outputOf(tile) === "lidar";
    tile.canvas.style.aspectRatio = "16 / 9";
    tile.points = isLidar ? new PointView(tile.canvas, this.tagColors) : null;
    if (tile.view) tile.view.hidden = tile.size.hidden = isLidar;
    tile.colors.hidden = !isLidar;
    this.color(tile);
    if (isLidar && !tile.points.gl) tile.label.textContent = "this browser has no WebGL";
  }

  outputOf(tile) {
    return tile.output ? tile.output.value : tile.source.value.split("/")[1];
  }

  color(tile) {
    if (!tile.points) return;
    tile.points.isByTag = tile.colors.value === "tag";
    tile.points.draw();
  }

  // Requests the tiles anew if what they stand for has changed.
  follow(state, marker) {
    if (this.sensors) {
      this.request("sensors", this.list.map((tile) => {
        const [sensor, output] = tile.source.value.split("/");
        return { sensor, output };
      }));
      return;
    }
    const ids = new Set(state.actors.map(([id]) => id));
    const first = state.actors.find(([, kind]) => kind === 1)?.[0];
    const auto = ids.has(state.ego) ? state.ego : first;
    const carriers = { auto, selected: state.selected?.id };
    this.request("tiles", this.list.map((tile) => {
      const on = carriers[tile.carrier.value] ?? null;
      const blueprint = state.actors.find(([id]) => id === on)?.[2];
      return this.spec(tile, on, this.extents[blueprint] ?? CAR, marker);
    }));
  }

  request(type, tiles) {
    const request = JSON.stringify(tiles);
    if (request === this.requested) return;
    this.requested = request;
    this.connection.send({ type, tiles });
  }

  spec(tile, on, extents, [x, y]) {
    const output = tile.output.value, isLidar = output === "lidar";
    let [position, yaw, pitch] = isLidar ? lidarPlace(extents) : VIEWS[tile.view.value](extents);
    if (on === null) {
      const [offset, worldYaw, worldPitch] = isLidar ? lidarPlace(CAR) : WORLD_VIEW;
      position = [x + offset[0], y + offset[1], offset[2]];
      [yaw, pitch] = [worldYaw, worldPitch];
    }
    const size = isLidar ? LIDAR_SIZE : SIZES[tile.size.value];
    return { output, on, position_m: position, yaw_rad: yaw, pitch_rad: pitch, size, fov_rad: FOV_RAD };
  }

  // Keeps the boxes of the image that follows.
  keepBoxes({ channel, frame, boxes }) {
    if (this.list[channel]) this.list[channel].boxes = { frame, boxes };
  }

  drawBoxes(canvas, boxes) {
    if (!this.showsBoxes) return;
    const context = canvas.getContext("2d");
    context.lineWidth = Math.max(1, canvas.width / 640);
    context.font = `${Math.round(canvas.width / 60)}px system-ui, sans-serif`;
    for (const [, tag, name, [left, top, right, bottom]] of boxes) {
      const [r, g, b] = (this.tagColors[tag] ?? [128, 128, 128]).map((value) => 100 + value * 0.6);
      context.strokeStyle = context.fillStyle = `rgb(${r} ${g} ${b})`;
      context.strokeRect(left + 0.5, top + 0.5, right - left - 1, bottom - top - 1);
      if (right - left > canvas.width / 20) context.fillText(name, left + 2, top - 3);
    }
  }

  // Draws a message of a tile; the acknowledgement lets the next one come.
  async show(kind, channel, frame, bytes) {
    const tile = this.list[channel];
    try {
      if (tile && kind === IMAGE && !tile.points) {
        const image = await createImageBitmap(new Blob([bytes], { type: isPng(bytes) ? "image/png" : "image/jpeg" }));
        const { canvas } = tile;
        if (canvas.width !== image.width || canvas.height !== image.height) {
          Object.assign(canvas, { width: image.width, height: image.height });
        }
        canvas.getContext("2d").drawImage(image, 0, 0);
        image.close();
        if (tile.boxes?.frame === frame) this.drawBoxes(canvas, tile.boxes.boxes);
      } else if (tile && kind !== IMAGE && tile.points) {
        tile.points.load(bytes);
      }
    } finally {
      // Not while the page is hidden: its sensors then rest.
      requestAnimationFrame(() => this.connection.acknowledge(channel));
    }
    if (tile) this.count(tile, frame);
  }

  count(tile, frame) {
    tile.images += 1;
    const now = performance.now();
    if (now - tile.since > 1000) {
      tile.rate = tile.images * 1000 / (now - tile.since);
      [tile.images, tile.since] = [0, now];
    }
    tile.label.textContent = `${tile.rate.toFixed(0)} /s · ${frame}`;
  }
}
