// Pictures of cameras and lidars, each with what it shows, what carries it, and from where.

import { IMAGE } from "/connection.js";
import { PointView } from "/points.js";

const OUTPUTS = { color: "colour", depth: "depth", tags: "tags", instances: "instances", lidar: "lidar" };
const CARRIERS = { auto: "own or first vehicle", selected: "selected actor", world: "the marker" };
// Position in the space of the carrier (metres), yaw, pitch (radians, positive looks down).
const VIEWS = {
  chase: [[-7, 0, 3.2], 0, 0.2], front: [[1.2, 0, 1.7], 0, 0.05], rear: [[-1.5, 0, 1.7], Math.PI, 0.05],
  left: [[0, 0.6, 1.7], Math.PI / 2, 0.1], right: [[0, -0.6, 1.7], -Math.PI / 2, 0.1],
  above: [[0, 0, 35], 0, Math.PI / 2],
};
const SIZES = { "320 × 180": [320, 180], "640 × 360": [640, 360], "1280 × 720": [1280, 720] };
const LIDAR_SIZE = [720, 32], LIDAR_PLACE = [[0, 0, 2.4], 0, 0];
const FOV_RAD = Math.PI / 2;
// What stands at the marker looks north-east and down from here.
const WORLD_VIEW = [[-25, -25, 30], Math.PI / 4, 0.7];

export class Tiles {
  constructor(parent, connection) {
    this.parent = parent;
    this.connection = connection;
    this.list = [];
    this.requested = null;
    this.tagColors = [];
    const add = document.createElement("button");
    add.textContent = "Add a camera";
    add.onclick = () => { if (this.list.length < 8) this.add("color", "front"); };
    parent.append(this.adder = add);
  }

  begin(tagColors) {
    this.tagColors = tagColors;
    this.requested = null;
    if (!this.list.length) {
      this.add("color", "chase");
      this.add("lidar", "front");
    }
  }

  add(output, view) {
    const box = document.createElement("div");
    box.className = "tile";
    const bar = document.createElement("div");
    bar.className = "bar";
    const tile = { box, bar, images: 0, rate: 0, since: performance.now() };
    const choose = (options, value, onChange) => {
      const select = document.createElement("select");
      for (const [key, name] of Object.entries(options)) select.add(new Option(name, key));
      select.value = value;
      select.onchange = onChange ?? (() => {});
      bar.append(select);
      return select;
    };
    const names = (object) => Object.fromEntries(Object.keys(object).map((key) => [key, key]));
    tile.output = choose(OUTPUTS, output, () => this.prepare(tile));
    tile.carrier = choose(CARRIERS, "auto");
    tile.view = choose(names(VIEWS), view);
    tile.size = choose(names(SIZES), "640 × 360");
    tile.colors = choose({ height: "height", tag: "tags" }, "tag", () => this.color(tile));
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
    const isLidar = tile.output.value === "lidar";
    tile.canvas.style.aspectRatio = "16 / 9";
    tile.points = isLidar ? new PointView(tile.canvas, this.tagColors) : null;
    tile.view.hidden = tile.size.hidden = isLidar;
    tile.colors.hidden = !isLidar;
    this.color(tile);
    if (isLidar && !tile.points.gl) tile.label.textContent = "this browser has no WebGL";
  }

  color(tile) {
    if (!tile.points) return;
    tile.points.isByTag = tile.colors.value === "tag";
    tile.points.draw();
  }

  // Requests the tiles anew if what they stand for has changed.
  follow(state, marker) {
    const ids = new Set(state.actors.map(([id]) => id));
    const first = state.actors.find(([, kind]) => kind === 1)?.[0];
    const auto = ids.has(state.ego) ? state.ego : first;
    const tiles = this.list.map((tile) => this.spec(tile, { auto, selected: state.selected?.id }, marker));
    const request = JSON.stringify(tiles);
    if (request !== this.requested) {
      this.requested = request;
      this.connection.send({ type: "tiles", tiles });
    }
  }

  spec(tile, carriers, [x, y]) {
    const output = tile.output.value, isLidar = output === "lidar";
    const on = carriers[tile.carrier.value] ?? null;
    let [position, yaw, pitch] = isLidar ? LIDAR_PLACE : VIEWS[tile.view.value];
    if (on === null) {
      const [offset, worldYaw, worldPitch] = isLidar ? LIDAR_PLACE : WORLD_VIEW;
      position = [x + offset[0], y + offset[1], offset[2]];
      [yaw, pitch] = [worldYaw, worldPitch];
    }
    const size = isLidar ? LIDAR_SIZE : SIZES[tile.size.value];
    return { output, on, position_m: position, yaw_rad: yaw, pitch_rad: pitch, size, fov_rad: FOV_RAD };
  }

  // Draws a message of a tile; the acknowledgement lets the next one come.
  async show(kind, channel, frame, bytes) {
    const tile = this.list[channel];
    try {
      if (tile && kind === IMAGE && !tile.points) {
        const image = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
        const { canvas } = tile;
        if (canvas.width !== image.width || canvas.height !== image.height) {
          Object.assign(canvas, { width: image.width, height: image.height });
        }
        canvas.getContext("2d").drawImage(image, 0, 0);
        image.close();
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
