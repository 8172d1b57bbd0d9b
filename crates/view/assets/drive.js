// Pedals and wheel of the page's own vehicle, from keys or a gamepad.

const KEYS = { KeyW: "throttle", ArrowUp: "throttle", KeyS: "brake", ArrowDown: "brake",
  KeyA: "left", ArrowLeft: "left", KeyD: "right", ArrowRight: "right", Space: "handbrake" };
const EVERY_MS = 33;
// Full steering takes a third of a second, so that a tap is a small correction.
const STEER_PER_S = 3;

export class Driver {
  constructor(send, label) {
    this.send = send;
    this.label = label;
    this.pressed = new Set();
    this.isReverse = false;
    this.steer = 0;
    this.ego = null;
    this.last = "";
    const isTyping = (event) => /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== "checkbox";
    addEventListener("keydown", (event) => {
      if (this.ego === null || isTyping(event) || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.code === "KeyQ" && !event.repeat) this.isReverse = !this.isReverse;
      if (!(event.code in KEYS)) return;
      event.preventDefault();
      this.pressed.add(event.code);
      this.update();
    });
    addEventListener("keyup", (event) => {
      this.pressed.delete(event.code);
      this.update();
    });
    // A key that is released elsewhere is not seen here.
    addEventListener("blur", () => this.pressed.clear());
    setInterval(() => this.update(EVERY_MS / 1000), EVERY_MS);
  }

  follow(ego) {
    if (ego !== this.ego) {
      this.ego = ego;
      [this.isReverse, this.steer, this.last] = [false, 0, ""];
    }
  }

  update(seconds = 0) {
    if (this.ego === null) {
      this.label.textContent = "";
      return;
    }
    const held = new Set([...this.pressed].map((code) => KEYS[code]));
    const aim = (held.has("left") ? 1 : 0) - (held.has("right") ? 1 : 0);
    const most = STEER_PER_S * seconds;
    this.steer += Math.max(-most, Math.min(most, aim - this.steer));
    const pedals = {
      throttle: held.has("throttle") ? 1 : 0, brake: held.has("brake") ? 1 : 0,
      steer: +this.steer.toFixed(3), handbrake: held.has("handbrake"), reverse: this.isReverse,
    };
    const pad = navigator.getGamepads?.().find((pad) => pad?.connected && pad.mapping === "standard");
    if (pad && !held.size) this.read(pad, pedals);
    const text = JSON.stringify(pedals);
    if (text !== this.last) {
      // Nothing is sent before the first key: a vehicle on autopilot keeps it.
      if (this.last || held.size || pedals.throttle || pedals.brake) this.send({ type: "drive", ...pedals });
      if (this.last || held.size || pedals.throttle || pedals.brake) this.last = text;
    }
    this.label.textContent = pedals.reverse ? "reverse" : "";
  }

  // The standard mapping: left stick, right and left trigger, A and Y.
  read(pad, pedals) {
    const axis = Math.abs(pad.axes[0]) > 0.06 ? pad.axes[0] : 0;
    pedals.steer = +(-axis * Math.abs(axis)).toFixed(3);
    pedals.throttle = +pad.buttons[7].value.toFixed(2);
    pedals.brake = +pad.buttons[6].value.toFixed(2);
    pedals.handbrake = pad.buttons[0].pressed;
    if (pad.buttons[3].pressed && !this.wasPressed) this.isReverse = !this.isReverse;
    this.wasPressed = pad.buttons[3].pressed;
    pedals.reverse = this.isReverse;
  }
}
