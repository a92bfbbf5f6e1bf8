// What waveform, intervals and return map share: numbers out of the page, axes, marks, the mouse.

const byId = (id) => document.getElementById(id);

/** Numbers of a typed array's kind, from little-endian bytes in base64. */
function unpacked(text, Kind) {
  return new Kind(Uint8Array.from(atob(text), (one) => one.charCodeAt(0)).buffer);
}

/** The colours of the page, light or dark. */
const ink = {};
function readInk() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ink", "soft", "line", "wave", "span", "card"]) {
    ink[name] = style.getPropertyValue(`--${name}`).trim();
  }
}

/** Labels with the digits that tell neighbouring ticks apart. */
function labels(chart, values, axis, space, step) {
  let digits = 0;
  while (digits < 12 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6) {
    digits += 1;
  }
  return values.map((value) => value.toFixed(digits));
}

function axis(label, upright) {
  return {
    label,
    labelSize: 22,
    size: upright ? 62 : 34,
    space: upright ? 36 : 96,
    font: "12px system-ui, sans-serif",
    labelFont: "12px system-ui, sans-serif",
    stroke: () => ink.soft,
    grid: { stroke: () => ink.line, width: 1 },
    ticks: { stroke: () => ink.line, width: 1, size: 5 },
    values: labels,
  };
}

/** A range with a margin; never empty. */
function padded(low, high, share) {
  if (low == null) return [0, 1]; // there is nothing in sight
  const margin = (high - low) * share || Math.abs(high) * share || 1;
  return [low - margin, high + margin];
}

/** Least and greatest of what is a number. */
function extent(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : [0, 1];
}

/**
 * A chart inside an element, drawn by uPlot: its lines are data, its marks are impacts.
 * `marks` has x and y, an impact each, and `near`, the weight of the height in finding the nearest.
 */
function chart(element, options, data, marks, selection) {
  const made = new uPlot(
    {
      width: element.clientWidth,
      height: element.clientHeight,
      legend: { show: false },
      padding: [8, 12, 0, 0],
      ...options,
      cursor: { y: false, points: { show: false }, ...options.cursor },
      hooks: {
        ...options.hooks,
        draw: [(u) => drawMarks(u, marks, selection)],
      },
    },
    data,
    element,
  );
  new ResizeObserver(() => {
    if (element.clientWidth) {
      made.setSize({ width: element.clientWidth, height: element.clientHeight });
    }
  }).observe(element);
  let pressed = null;
  made.over.addEventListener("mousedown", (event) => (pressed = [event.clientX, event.clientY]));
  made.over.addEventListener("click", (event) => {
    // A drag ends in a click, too.
    const [x, y] = pressed ?? [event.clientX, event.clientY];
    if (Math.hypot(event.clientX - x, event.clientY - y) > 4) return;
    const box = made.over.getBoundingClientRect();
    const found = nearest(made, marks, event.clientX - box.left, event.clientY - box.top);
    if (found >= 0) selection.choose(found, marks.zooms);
  });
  element.chart = made;
  return made;
}

function nearest(u, marks, left, top) {
  let [best, found] = [Infinity, -1];
  for (let i = 0; i < marks.x.length; i += 1) {
    const across = u.valToPos(marks.x[i], "x") - left;
    const up = (u.valToPos(marks.y[i], "y") - top) * marks.near;
    const distance = across * across + up * up;
    if (distance < best) [best, found] = [distance, i];
  }
  return found;
}

function drawMarks(u, marks, selection) {
  const { ctx, bbox } = u;
  const ratio = uPlot.pxRatio;
  const [low, high] = [u.scales.x.min, u.scales.x.max];
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  const size = Math.round((marks.x.length > 2000 ? 3 : 5) * ratio);
  for (let i = 0; i < marks.x.length; i += 1) {
    if (!(marks.x[i] >= low && marks.x[i] <= high)) continue;
    ctx.fillStyle = marks.colour(i);
    const x = u.valToPos(marks.x[i], "x", true);
    const y = u.valToPos(marks.y[i], "y", true);
    ctx.fillRect(x - size / 2, y - size / 2, size, size);
  }
  const one = selection.index;
  if (one >= 0 && Number.isFinite(marks.x[one]) && Number.isFinite(marks.y[one])) {
    ctx.strokeStyle = ink.ink;
    ctx.lineWidth = 2 * ratio;
    ctx.beginPath();
    ctx.arc(u.valToPos(marks.x[one], "x", true), u.valToPos(marks.y[one], "y", true),
      7 * ratio, 0, 2 * Math.PI);
    ctx.stroke();
  }
  ctx.restore();
}

/** A tinted span of the horizontal axis, behind what is drawn. */
function tint(u, from, to) {
  const { ctx, bbox } = u;
  const left = Math.max(u.valToPos(from, "x", true), bbox.left);
  const right = Math.min(u.valToPos(to, "x", true), bbox.left + bbox.width);
  if (right < left) return;
  ctx.fillStyle = ink.span;
  ctx.fillRect(left, bbox.top, Math.max(right - left, uPlot.pxRatio), bbox.height);
}
