// The table of impacts: sorted by any column, and only the rows in sight are in the page.

const BESIDE = 12; // rows kept above and below those in sight

/** A number as the page's Python writes it: ".6f", ".4g"; "" one digit of a standard error. */
function written(value, form) {
  if (form === "stop") return value >= 0 ? String(value) : "\u2013";
  if (!Number.isFinite(value)) return "\u2013";
  if (form.endsWith("f")) return value.toFixed(Number(form.slice(1, -1)));
  const digits = form ? Number(form.slice(1, -1)) : 1;
  const rounded = Number(value.toPrecision(digits));
  const size = Math.abs(rounded);
  const plain = size === 0 || (size >= 1e-4 && size < (form ? 10 ** digits : 1e5));
  return plain ? String(rounded) : rounded.toExponential();
}

function impactTable(impacts, selection) {
  const table = document.querySelector("table.impacts");
  if (!table) return { show() {} };
  const scroll = table.parentElement;
  const body = table.createTBody();
  body.className = "live";
  table.setAttribute("aria-rowcount", impacts.count + 1);
  const columns = [
    { values: impacts.number, text: (i) => String(impacts.number[i]) },
    ...impacts.columns.map(({ values, form }) => ({ values, text: (i) => written(values[i], form) })),
    { values: impacts.flags, text: (i) => impacts.flagNames[impacts.flags[i]] },
  ];
  const heads = [...table.tHead.rows[0].cells];
  const order = Array.from({ length: impacts.count }, (_, i) => i);
  const place = new Int32Array(impacts.count);
  const spacers = [0, 1].map(() => {
    const row = document.createElement("tr");
    row.setAttribute("aria-hidden", "true");
    row.append(document.createElement("td"));
    row.firstChild.colSpan = columns.length;
    row.firstChild.className = "spacer";
    return row;
  });
  let height = 0;
  let shown = [-1, -1];

  function row(at) {
    const i = order[at];
    const made = document.createElement("tr");
    made.setAttribute("aria-rowindex", at + 2);
    made.dataset.impact = i;
    columns.forEach((column, k) => {
      const cell = document.createElement(k ? "td" : "th");
      if (k) cell.textContent = column.text(i);
      else {
        cell.scope = "row";
        const button = document.createElement("button");
        button.type = "button";
        button.textContent = column.text(i);
        button.setAttribute("aria-label", `Select impact ${column.text(i)}`);
        cell.append(button);
      }
      made.append(cell);
    });
    return made;
  }

  function mark() {
    const chosen = selection.index < 0 ? order[0] : selection.index;
    for (const one of body.querySelectorAll("tr[data-impact]")) {
      const i = Number(one.dataset.impact);
      if (i === selection.index) one.setAttribute("aria-current", "true");
      else one.removeAttribute("aria-current");
      // One stop of the tab key; the arrows go on from there.
      one.querySelector("button").tabIndex = i === chosen ? 0 : -1;
    }
    const there = body.querySelector('button[tabindex="0"]');
    if (!there) body.querySelector("button").tabIndex = 0;
  }

  function lay(anew) {
    const first = Math.max(0, Math.floor(scroll.scrollTop / height) - BESIDE);
    const last = Math.min(
      impacts.count, Math.ceil((scroll.scrollTop + scroll.clientHeight) / height) + BESIDE);
    if (!anew && first === shown[0] && last === shown[1]) return;
    const focused = body.contains(document.activeElement)
      ? Number(document.activeElement.closest("tr").dataset.impact) : -1;
    shown = [first, last];
    spacers[0].firstChild.style.height = `${first * height}px`;
    spacers[1].firstChild.style.height = `${(impacts.count - last) * height}px`;
    const rows = [];
    for (let at = first; at < last; at += 1) rows.push(row(at));
    body.replaceChildren(spacers[0], ...rows, spacers[1]);
    mark();
    if (focused >= 0) {
      body.querySelector(`tr[data-impact="${focused}"] button`)?.focus({ preventScroll: true });
    }
  }

  function sort(k, descending) {
    const { values } = columns[k];
    const sign = descending ? -1 : 1;
    // What is not measured stands last either way.
    order.sort((a, b) => {
      const [x, y] = [values[a], values[b]];
      if (Number.isNaN(x) || Number.isNaN(y)) return Number.isNaN(x) - Number.isNaN(y) || a - b;
      return sign * (x - y) || a - b;
    });
    order.forEach((i, at) => (place[i] = at));
    heads.forEach((head, j) => {
      if (j === k) head.setAttribute("aria-sort", descending ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    });
    scroll.scrollTop = 0;
    lay(true);
  }

  function reveal(i, focus) {
    const top = place[i] * height;
    const head = table.tHead.offsetHeight;
    if (top < scroll.scrollTop || top + height > scroll.scrollTop + scroll.clientHeight - head) {
      scroll.scrollTop = Math.max(0, top - scroll.clientHeight / 2);
    }
    lay(true);
    if (focus) body.querySelector(`tr[data-impact="${i}"] button`)?.focus({ preventScroll: true });
  }

  heads.forEach((head, k) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = head.textContent;
    head.replaceChildren(button);
    button.addEventListener("click", () => sort(k, head.getAttribute("aria-sort") === "ascending"));
  });
  body.addEventListener("click", (event) => {
    const there = event.target.closest("tr[data-impact]");
    if (there) selection.choose(Number(there.dataset.impact), true);
  });
  body.addEventListener("keydown", (event) => {
    const there = event.target.closest("tr[data-impact]");
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10,
      Home: -impacts.count, End: impacts.count }[event.key];
    if (!there || !step) return;
    event.preventDefault();
    const at = place[Number(there.dataset.impact)] + step;
    const next = order[Math.min(Math.max(at, 0), impacts.count - 1)];
    reveal(next, true);
    selection.choose(next, true);
  });
  scroll.addEventListener("scroll", () => lay(false), { passive: true });

  body.append(row(0));
  height = body.rows[0].getBoundingClientRect().height || 28;
  sort(0, false);
  lay(false); // now as high as the table stands
  return { show: (i) => reveal(i, false) };
}
