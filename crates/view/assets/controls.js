// The controls beside the pictures: weather, and the details of the selected actor.

// Field, label, least, most, step.
const FIELDS = [
  ["hour", "time of day", 0, 24, 0.25], ["cloudiness", "clouds", 0, 100, 1],
  ["precipitation", "rain", 0, 100, 1], ["precipitation_deposits", "puddles", 0, 100, 1],
  ["wetness", "wetness", 0, 100, 1], ["fog_density", "fog", 0, 100, 1],
  ["wind_intensity", "wind", 0, 100, 1],
];
// The sun of a day at the equinox, 60 degrees high at noon in the south; azimuth counter-clockwise
// from east.
const NOON_ALTITUDE_RAD = Math.PI / 3;

function sunOf(hour) {
  const angle = (hour - 6) * Math.PI / 12;
  const altitude = Math.asin(Math.sin(angle) * Math.sin(NOON_ALTITUDE_RAD));
  const azimuth = -Math.atan2(Math.sin(angle) * Math.cos(NOON_ALTITUDE_RAD), Math.cos(angle));
  return { sun_altitude_rad: altitude, sun_azimuth_rad: azimuth };
}

// The hour whose sun is as high, before or after noon as the sun is in the east or the west.
function hourOf({ sun_altitude_rad, sun_azimuth_rad }) {
  const sine = Math.sin(sun_altitude_rad) / Math.sin(NOON_ALTITUDE_RAD);
  const angle = Math.asin(Math.max(-1, Math.min(1, sine)));
  const hour = Math.cos(sun_azimuth_rad) >= 0 ? angle : Math.PI - angle;
  return (hour * 12 / Math.PI + 6 + 24) % 24;
}

export class WeatherControls {
  constructor(parent, send) {
    // Of the world, from its first state on.
    this.weather = null;
    this.canChange = true;
    this.inputs = {};
    for (const [field, name, min, max, step] of FIELDS) {
      const label = document.createElement("label"), input = document.createElement("input");
      const value = document.createElement("span");
      Object.assign(input, { type: "range", min, max, step, disabled: true });
      input.oninput = () => {
        const number = Number(input.value);
        Object.assign(this.weather, field === "hour" ? sunOf(number) : { [field]: number });
        this.changed = performance.now();
        this.show();
        if (this.timer) return;
        // At most ten a second while a slider moves.
        this.timer = setTimeout(() => {
          this.timer = null;
          send({ type: "weather", ...this.weather });
        }, 100);
      };
      label.append(name, input, value);
      parent.append(label);
      this.inputs[field] = { input, value };
    }
  }

  // The weather that was set last, by whichever client.
  follow(weather) {
    // What was moved just now is on its way.
    if (!weather || this.timer || performance.now() - (this.changed ?? -1e9) < 1000) return;
    if (JSON.stringify(weather) === JSON.stringify(this.weather)) return;
    this.weather = { ...weather };
    this.show();
  }

  show() {
    for (const [field, { input, value }] of Object.entries(this.inputs)) {
      input.disabled = !this.canChange;
      const number = field === "hour" ? hourOf(this.weather) : this.weather[field];
      if (document.activeElement !== input || field !== "hour") input.value = number;
      const shown = Number(input.value);
      value.textContent = field === "hour"
        ? `${Math.floor(shown)}:${String(Math.round(shown % 1 * 60)).padStart(2, "0")}` : shown;
    }
  }
}

const three = (numbers, unit) => `${numbers.map((n) => n.toFixed(2)).join(", ")} ${unit}`;

// Fills the table of the selected actor.
export function showDetails(table, details) {
  const rows = !details ? [["", "click an actor on the map"]] : [
    ["id", `${details.id}, ${details.kind}`], ["blueprint", details.blueprint],
    ["position", three(details.position_m, "m")],
    ["yaw", `${(details.yaw_rad * 180 / Math.PI).toFixed(1)}°`],
    ["speed", `${(Math.hypot(...details.velocity_mps) * 3.6).toFixed(1)} km/h`],
    ["velocity", three(details.velocity_mps, "m/s")],
  ];
  if (details?.acceleration_mps2) {
    rows.push(["acceleration", three(details.acceleration_mps2, "m/s²")],
      ["rotation", three(details.angular_velocity_radps, "rad/s")]);
  }
  if (details?.vehicle) {
    const { throttle, brake, steer, gear, engine_rpm } = details.vehicle;
    rows.push(["pedals", `throttle ${throttle.toFixed(2)}, brake ${brake.toFixed(2)}`],
      ["steering", steer.toFixed(3)], ["engine", `gear ${gear}, ${engine_rpm.toFixed(0)} /min`]);
  }
  if (details?.phase) rows.push(["shows", details.phase]);
  if (details?.flags.length) rows.push(["state", details.flags.join(", ").toLowerCase()]);
  while (table.rows.length > rows.length) table.deleteRow(-1);
  rows.forEach(([name, value], i) => {
    const row = table.rows[i] ?? table.insertRow();
    const cells = [0, 1].map((j) => row.cells[j] ?? row.insertCell());
    [cells[0].textContent, cells[1].textContent] = [name, value];
  });
}
