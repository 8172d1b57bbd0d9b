// The map from above: lanes, actors, the marker. World space: x to the right, y up, metres.

const LANE_COLORS = new Map([
  [0x2, "#4a4f57"], [0x20000, "#4a4f57"], [0x40000, "#4a4f57"], [0x200, "#57504f"],
  [0x80000, "#514f57"], [0x100000, "#514f57"], [0x20, "#6f6a62"], [0x8, "#5d6265"],
  [0x4, "#5d6265"], [0x10, "#7a4d45"], [0x100, "#565b70"], [0x400, "#4f6142"],
]);
const OTHER_LANE = "#3c4436";
const VEHICLE = 1, WALKER = 2, LIGHT = 3;
const PHASES = ["#e5484d", "#e8b33c", "#46a758", "#5c6570"];

// Adds the area between two cross sections, each with a left and a right border. All areas have the same
// orientation: in one path, areas of opposite orientation would cancel out where they overlap, as they
// do in the narrow bends of junctions.
function addQuad(path, [ax, ay, bx, by, cx, cy, dx, dy]) {
  const add = (...points) => {
    const area = points.reduce((sum, [x, y], i) => {
      const [nextX, nextY] = points[(i + 1) % points.length];
      return sum + x * nextY - nextX * y;
    }, 0);
    if (area < 0) points.reverse();
    points.forEach(([x, y], i) => path[i ? "lineTo" : "moveTo"](x, y));
    path.closePath();
  };
  // Two triangles: borders that meet or cross make no proper quadrilateral.
  add([ax, ay], [bx, by], [dx, dy]);
  add([ax, ay], [dx, dy], [cx, cy]);
}

export class MapView {
  constructor(canvas, onSelect) {
    this.canvas = canvas;
    this.lanes = [];
    this.center = [0, 0];
    this.metersWide = 300;
    this.marker = null;
    this.followed = null;
    this.extents = [];
    // Where the ego of a data set drives.
    this.path = [];
    let drag = null;
    canvas.onpointerdown = (event) => {
      drag = { x: event.offsetX, y: event.offsetY, isMoved: false };
      canvas.setPointerCapture(event.pointerId);
    };
    canvas.onpointermove = (event) => {
      if (!drag) return;
      const [dx, dy] = [event.offsetX - drag.x, event.offsetY - drag.y];
      if (!drag.isMoved && Math.hypot(dx, dy) < 4) return;
      this.center[0] -= dx / this.scale();
      this.center[1] += dy / this.scale();
      this.followed = null;
      drag = { x: event.offsetX, y: event.offsetY, isMoved: true };
    };
    canvas.onpointerup = (event) => {
      if (drag && !drag.isMoved) {
        const at = this.toWorld(event.offsetX, event.offsetY);
        if (event.shiftKey) this.marker = at;
        else onSelect(this.nearest(at));
      }
      drag = null;
    };
    canvas.ondblclick = (event) => {
      this.followed = this.nearest(this.toWorld(event.offsetX, event.offsetY));
    };
    canvas.onwheel = (event) => {
      event.preventDefault();
      const before = this.toWorld(event.offsetX, event.offsetY);
      this.metersWide = Math.min(2e4, Math.max(20, this.metersWide * 1.0015 ** event.deltaY));
      const after = this.toWorld(event.offsetX, event.offsetY);
      this.center = this.center.map((c, i) => c + before[i] - after[i]);
    };
  }

  // Pixels per metre.
  scale() {
    return this.canvas.clientWidth / this.metersWide;
  }

  toWorld(x, y) {
    const scale = this.scale();
    return [
      this.center[0] + (x - this.canvas.clientWidth / 2) / scale,
      this.center[1] - (y - this.canvas.clientHeight / 2) / scale,
    ];
  }

  // Each lane: its type, the number of its cross sections, and of each the left and right border.
  load(buffer) {
    const view = new DataView(buffer);
    const paths = new Map();
    const bounds = [Infinity, Infinity, -Infinity, -Infinity];
    for (let offset = 0; offset < buffer.byteLength;) {
      const kind = view.getUint32(offset, true), count = view.getUint32(offset + 4, true);
      const numbers = new Float32Array(buffer, offset + 8, count * 4);
      offset += 8 + count * 16;
      if (!paths.has(kind)) paths.set(kind, { fill: new Path2D(), edge: new Path2D() });
      const { fill, edge } = paths.get(kind);
      for (let i = 0; i < count; i++) {
        const [x, y] = [numbers[4 * i], numbers[4 * i + 1]];
        if (i) addQuad(fill, numbers.subarray(4 * i - 4, 4 * i + 4));
        edge[i ? "lineTo" : "moveTo"](x, y);
        bounds[0] = Math.min(bounds[0], x); bounds[1] = Math.min(bounds[1], y);
        bounds[2] = Math.max(bounds[2], x); bounds[3] = Math.max(bounds[3], y);
      }
    }
    // Driving lanes above the others.
    this.lanes = [...paths].sort(([a], [b]) => (a === 2) - (b === 2));
    if (Number.isFinite(bounds[0])) {
      this.center = [(bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2];
      this.middle = [...this.center];
      const aspect = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
      this.metersWide = 1.05 * Math.max(bounds[2] - bounds[0], (bounds[3] - bounds[1]) * aspect, 50);
    }
    this.followed = this.marker = null;
  }

  nearest([x, y]) {
    let found = null, least = Math.max(4, 12 / this.scale());
    for (const [id, , , ax, ay] of this.state?.actors ?? []) {
      const distance = Math.hypot(ax - x, ay - y);
      if (distance < least) [found, least] = [id, distance];
    }
    return found;
  }

  draw(state) {
    this.state = state;
    const { canvas } = this, ratio = devicePixelRatio;
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = "#23291f";
    context.fillRect(0, 0, width, height);
    const followed = state?.actors.find(([id]) => id === this.followed);
    if (followed) this.center = [followed[3], followed[4]];
    const scale = this.scale() * ratio;
    context.setTransform(scale, 0, 0, -scale,
      width / 2 - this.center[0] * scale, height / 2 + this.center[1] * scale);
    for (const [kind, { fill, edge }] of this.lanes) {
      context.fillStyle = LANE_COLORS.get(kind) ?? OTHER_LANE;
      context.fill(fill);
      if (kind === 2 && scale > 1) {
        context.strokeStyle = "#9aa3ad55";
        context.lineWidth = 0.12;
        context.stroke(edge);
      }
    }
    // The path of the ego of a data set, or the lanes ahead of a vehicle.
    context.strokeStyle = "#ffb45499";
    context.lineWidth = 2 * ratio / scale;
    context.beginPath();
    for (const line of [this.path, ...state?.ahead_m ?? []]) {
      line.forEach(([x, y], i) => context[i ? "lineTo" : "moveTo"](x, y));
    }
    context.stroke();
    state?.actors.forEach((actor, i) =>
      this.drawActor(context, actor, state.extents_m?.[i], state, ratio / scale));
    if (this.marker) {
      context.strokeStyle = "#ffb454";
      context.lineWidth = 2 * ratio / scale;
      context.beginPath();
      context.arc(...this.marker, 6 * ratio / scale, 0, 2 * Math.PI);
      context.stroke();
    }
  }

  // `pixel` is the size of a pixel in metres: nothing is drawn smaller than a few of them.
  drawActor(context, [id, kind, blueprint, x, y, , yaw, , state], own, { ego, selected }, pixel) {
    context.save();
    context.translate(x, y);
    if (kind === LIGHT) {
      context.fillStyle = PHASES[Math.min(state, 3)];
      context.beginPath();
      context.arc(0, 0, Math.max(0.5, 2.5 * pixel), 0, 2 * Math.PI);
      context.fill();
    } else {
      const [length, width] = own ?? this.extents[blueprint] ?? [0.4, 0.4];
      const [l, w] = [Math.max(length, 4 * pixel), Math.max(width, 2 * pixel)];
      context.rotate(yaw);
      context.fillStyle = id === ego ? "#ffb454" : kind === VEHICLE ? "#58a6ff"
        : kind === WALKER ? "#e879c6" : "#a39b8b";
      context.beginPath();
      context.moveTo(l, 0);
      context.lineTo(l * 0.6, w); context.lineTo(-l, w);
      context.lineTo(-l, -w); context.lineTo(l * 0.6, -w);
      context.fill();
    }
    if (id === selected?.id) {
      context.strokeStyle = "#fff";
      context.lineWidth = 1.5 * pixel;
      context.beginPath();
      context.arc(0, 0, Math.max(3, 9 * pixel), 0, 2 * Math.PI);
      context.stroke();
    }
    context.restore();
  }
}
