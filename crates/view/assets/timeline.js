// The parts of the newest complete frame by stage, in milliseconds since its first instant.

const STAGES = ["host", "traffic", "renderer", "GPU", "viewer"];
const COLORS = { wakes: "#5c6570", commands: "#b084eb", physics: "#58a6ff", publishing: "#3f7fbf",
  plans: "#46a758", sends: "#7a8a5a", traces: "#e8873c", copies: "#b5651d", reads: "#e879c6" };
const LABELS_PX = 62, AXIS_PX = 16;

export function drawTimeline(canvas, timeline) {
  const ratio = devicePixelRatio, { clientWidth: width, clientHeight: height } = canvas;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.fillStyle = "#1e2329";
  context.fillRect(0, 0, width, height);
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "middle";
  if (!timeline) return;
  const longest = Math.max(0.1, ...timeline.parts.map((part) => part[3]));
  // A round scale that changes seldom.
  const power = 10 ** Math.floor(Math.log10(longest));
  const end = power * [1, 2, 5, 10].find((n) => n * power >= longest);
  const toX = (ms) => LABELS_PX + (width - LABELS_PX - 8) * ms / end;
  const stages = STAGES.filter((stage) => timeline.parts.some((part) => part[0] === stage));
  const row = (height - AXIS_PX - 4) / stages.length;
  stages.forEach((stage, i) => {
    context.fillStyle = "#929ca8";
    context.fillText(stage, 6, 4 + row * (i + 0.5));
  });
  for (const [stage, part, begin, until] of timeline.parts) {
    const y = 4 + row * stages.indexOf(stage), [x0, x1] = [toX(begin), toX(until)];
    context.fillStyle = COLORS[part] ?? "#888";
    context.fillRect(x0, y + 2, Math.max(1, x1 - x0), row - 4);
    const text = `${part} ${(until - begin).toFixed(2)}`;
    if (context.measureText(text).width < x1 - x0 - 6) {
      context.fillStyle = "#0d1014";
      context.fillText(text, x0 + 3, y + row / 2);
    }
  }
  context.fillStyle = "#929ca8";
  for (let i = 0; i <= 4; i++) {
    const text = `${+(end * i / 4).toFixed(3)}`, x = toX(end * i / 4);
    context.fillText(text, i === 4 ? x - context.measureText(text).width : x, height - AXIS_PX / 2);
  }
  const title = `frame ${timeline.frame}, ms`;
  context.fillText(title, width - 8 - context.measureText(title).width, 10);
}
