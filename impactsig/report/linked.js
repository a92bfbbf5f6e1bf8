// The page: its charts and its table, which show one span of time and one impact chosen.

const page = JSON.parse(byId("numbers").textContent);
const impacts = {
  number: unpacked(page.impacts.number, Uint32Array),
  time: unpacked(page.impacts.time, Float64Array),
  contact: unpacked(page.impacts.contact, Float32Array),
  before: unpacked(page.impacts.before, Float32Array),
  after: unpacked(page.impacts.after, Float32Array),
  flags: unpacked(page.impacts.flags, Uint16Array),
  flagNames: page.impacts.flagNames,
  columns: page.impacts.columns.map((one) => ({
    ...one,
    values: unpacked(one.values, one.head === "time [s]" ? Float64Array : Float32Array),
  })),
};
impacts.count = impacts.time.length;
const colours = unpacked(page.impacts.colour, Uint8Array);
// Where stops have colours, the waveform has none.
const waveInk = () => (page.impacts.colours.length > 1 ? ink.soft : ink.wave);
const colourOf = (i) => page.impacts.colours[colours[i]][1];

/** The impact chosen; `choose` tells all that show it. */
const selection = {
  index: -1,
  choose(index, zoom) {
    selection.index = index;
    if (zoom) zoomTo(index);
    redraw();
    table.show(index);
    byId("chosen").textContent = described(index);
  },
};

/** Samples of a span of codes. */
function decoded(codes, low, step) {
  return Array.from(codes, (code) => (code > 65534 ? null : low + step * code));
}

/** Times, the overview, and nothing yet of the samples: drawn of long spans. */
function overview(panel) {
  const [low, step, packed] = panel.overview;
  const every = decoded(unpacked(packed, Uint16Array), low, step);
  const at = every.map((_, i) => panel.start + i * panel.step);
  const none = every.map(() => null);
  return panel.reduced ? [at, every, none] : [at, none, every];
}

/** The samples where they are held and the overview elsewhere: drawn of short spans. */
function near(panel) {
  const [at, every] = panel.far;
  const held = panel.spans;
  const drawn = [[], [], []];
  const add = (x, coarse, fine) => [x, coarse, fine].forEach((one, k) => drawn[k].push(one));
  let from = 0;
  let begin = 0;
  held.start.forEach((start, k) => {
    const codes = held.codes.subarray(begin, (begin += held.count[k]));
    const end = start + codes.length / panel.rate;
    const [low, high] = [held.low[k], held.low[k] + 65535 * held.step[k]];
    // An extreme that the samples hold themselves is drawn where it was, not at the edge of its bin.
    const outside = (value) => value < low || value > high;
    for (; from < at.length && at[from] < start; from += 1) {
      if (at[from] < start - 2 * panel.step || outside(every[from])) add(at[from], every[from], null);
    }
    decoded(codes, held.low[k], held.step[k]).forEach((value, j) =>
      add(start + j / panel.rate, null, value));
    for (; from < at.length && at[from] < end; from += 1) {
      if (outside(every[from])) add(end, every[from], null);
    }
  });
  for (; from < at.length; from += 1) add(at[from], every[from], null);
  return drawn;
}

for (const panel of page.panels) {
  const { spans } = panel;
  panel.spans = {
    impact: unpacked(spans.impact, Uint32Array),
    start: unpacked(spans.start, Float64Array),
    count: unpacked(spans.count, Uint32Array),
    low: unpacked(spans.low, Float64Array),
    step: unpacked(spans.step, Float64Array),
    codes: unpacked(spans.codes, Uint16Array),
  };
  panel.far = overview(panel);
  panel.drawn = panel.far;
}
const whole = [
  Math.min(...page.panels.map((panel) => panel.far[0][0])),
  Math.max(...page.panels.map((panel) => panel.far[0].at(-1))),
];
const finest = 8 / Math.max(...page.panels.map((panel) => panel.rate));
let seen = whole;

/** Points of the overview below which their spans could be told apart. */
const BINS = 3000;

/** Show a span of time in every waveform. */
function view(from, to) {
  const length = Math.min(Math.max(to - from, finest), whole[1] - whole[0]);
  const start = Math.min(Math.max((from + to - length) / 2, whole[0]), whole[1] - length);
  if (start === seen[0] && start + length === seen[1]) return;
  seen = [start, start + length];
  waveforms.forEach((one, k) => {
    const panel = page.panels[k];
    const short = panel.reduced && length < BINS * panel.step;
    const drawn = short ? (panel.near ??= near(panel)) : panel.far;
    if (drawn !== panel.drawn) one.setData((panel.drawn = drawn), false);
    one.setScale("x", { min: seen[0], max: seen[1] });
  });
  redraw();
}

const scaled = (factor, at = (seen[0] + seen[1]) / 2) =>
  view(at - (at - seen[0]) * factor, at + (seen[1] - at) * factor);

function zoomTo(index) {
  const contact = impacts.contact[index];
  const margin = contact ? Math.max(contact, 3 * finest) : 5e-3;
  view(impacts.time[index] - margin, impacts.time[index] + contact + 3 * margin);
}

function redraw() {
  for (const one of [...waveforms, ...others]) one.redraw(false);
}

function described(i) {
  const words = impacts.columns
    .filter(({ form, values }) => form && form !== "stop" && Number.isFinite(values[i]))
    .map(({ head, form, values }) => {
      const [, name, unit] = head.match(/^(.*?)(?: \[(.*)\])?$/);
      return `${name} ${written(values[i], form)}${unit ? ` ${unit}` : ""}`;
    });
  const held = page.panels.some((panel) => !panel.reduced || panel.place.has(impacts.number[i] - 1));
  const said = held
    ? "Drawn by its samples."
    : "This page does not hold its samples: drawn by the least and greatest of each span.";
  return `Impact ${impacts.number[i]}: ${words.join(", ")}. ${said}`;
}

/** Call `turned(factor, left, top)` at a turn of the wheel, unless there is no farther away. */
function wheel(u, farthest, turned) {
  u.over.addEventListener("wheel", (event) => {
    if (event.deltaY > 0 && farthest()) return; // the page scrolls on
    event.preventDefault();
    const box = u.over.getBoundingClientRect();
    turned(1.25 ** Math.sign(event.deltaY), event.clientX - box.left, event.clientY - box.top);
  }, { passive: false });
}

/** Call `dragged` with what was drawn over by the mouse, and forget it. */
function onDrag(dragged) {
  return (u) => {
    const { left, top, width, height } = u.select;
    u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    dragged(u, left, top, width, height);
  };
}

readInk();
const waveforms = page.panels.map((panel, k) => {
  panel.place = new Set(panel.spans.impact);
  const one = chart(
    byId("waveform").children[k],
    {
      scales: { x: { time: false }, y: { range: (u, low, high) => padded(low, high, 0.08) } },
      axes: [
        axis(k === page.panels.length - 1 ? "time [s]" : "", false),
        axis(panel.unit ? `${panel.name} [${panel.unit}]` : panel.name, true),
      ],
      series: [
        {},
        { stroke: waveInk, width: 1, points: { show: false } },
        {
          stroke: waveInk,
          width: 1.5,
          points: {
            show: (u, series, from, to) => to - from < 400,
            size: 5, fill: waveInk, stroke: waveInk,
          },
        },
      ],
      cursor: { drag: { x: true, y: false, setScale: false } },
      hooks: {
        setSelect: [onDrag((u, left, top, width) => {
          if (width > 4) view(u.posToVal(left, "x"), u.posToVal(left + width, "x"));
        })],
        drawClear: [(u) => {
          const i = selection.index;
          if (i >= 0) tint(u, impacts.time[i], impacts.time[i] + impacts.contact[i]);
        }],
      },
    },
    panel.far,
    { x: impacts.time, y: unpacked(panel.heights, Float32Array), colour: colourOf, near: 0.3, zooms: false },
    selection,
  );
  wheel(one, () => seen[1] - seen[0] >= whole[1] - whole[0],
    (factor, left) => scaled(factor, one.posToVal(left, "x")));
  one.over.addEventListener("dblclick", () => view(...whole));
  return one;
});

/** Show these ranges of a chart of points. */
function frame(u, [x, y]) {
  u.batch(() => {
    u.setScale("x", { min: x[0], max: x[1] });
    u.setScale("y", { min: y[0], max: y[1] });
  });
}

/** A chart of points alone: its data are only the corners of what is seen. */
function scatter(id, x, y, labelled, ranges, hooks = {}, drag = { x: false, y: false }) {
  if (!byId(id)) return [];
  const hidden = { paths: () => null, points: { show: false } };
  return [chart(
    byId(id),
    {
      scales: {
        x: { time: false, auto: false, range: (u, low, high) => [low, high] },
        y: { auto: false, range: (u, low, high) => [low, high] },
      },
      axes: [axis(labelled[0], false), axis(labelled[1], true)],
      series: [{}, hidden],
      cursor: { drag },
      hooks: { ...hooks, ready: [(u) => frame(u, ranges)] },
    },
    [ranges[0], ranges[1]],
    { x, y, colour: colourOf, near: 1, zooms: true },
    selection,
  )];
}

const { time, before, after } = impacts;
const pairs = [
  padded(...extent(Float32Array.from(before, (one, i) => one + 0 * after[i])), 0.08),
  padded(...extent(Float32Array.from(after, (one, i) => one + 0 * before[i])), 0.08),
];
const returnMap = scatter("return-map", before, after, ["interval [ms]", "next interval [ms]"], pairs,
  {
    setSelect: [onDrag((u, left, top, width, height) => {
      if (width < 5 || height < 5) return;
      frame(u, [
        [u.posToVal(left, "x"), u.posToVal(left + width, "x")],
        [u.posToVal(top + height, "y"), u.posToVal(top, "y")],
      ]);
    })],
  },
  { x: true, y: true, setScale: false });
const others = [
  ...scatter("intervals", time, before, ["time [s]", "interval before [ms]"],
    [whole, [0, 1.08 * extent(before)[1]]],
    { drawClear: [(u) => seen !== whole && tint(u, ...seen)] }),
  ...returnMap,
];
const wholeMap = () => returnMap.forEach((one) => frame(one, pairs));
for (const one of returnMap) {
  const ranges = () => ["x", "y"].map((key) => [one.scales[key].min, one.scales[key].max]);
  wheel(one, () => ranges().every(([low, high], k) => high - low >= pairs[k][1] - pairs[k][0]),
    (factor, left, top) => {
      const at = [one.posToVal(left, "x"), one.posToVal(top, "y")];
      frame(one, ranges().map(([low, high], k) => [
        Math.max(at[k] + (low - at[k]) * factor, pairs[k][0]),
        Math.min(at[k] + (high - at[k]) * factor, pairs[k][1]),
      ]));
    });
  one.over.addEventListener("dblclick", wholeMap);
}
const table = impactTable(impacts, selection);

const step = (by) => {
  const last = impacts.count - 1;
  const from = selection.index < 0 ? (by > 0 ? -1 : last + 1) : selection.index;
  if (last >= 0) selection.choose(Math.min(Math.max(from + by, 0), last), true);
};
const moved = (share) => view(...seen.map((one) => one + share * (seen[1] - seen[0])));
const actions = {
  previous: () => step(-1), next: () => step(1), nearer: () => scaled(0.5), farther: () => scaled(2),
  earlier: () => moved(-0.5), later: () => moved(0.5),
  whole: () => {
    view(...whole);
    wholeMap();
  },
};
for (const button of document.querySelectorAll("button[data-do]")) {
  button.addEventListener("click", actions[button.dataset.do]);
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  readInk();
  redraw();
});
requestAnimationFrame(() => (document.documentElement.dataset.drawn = performance.now()));
