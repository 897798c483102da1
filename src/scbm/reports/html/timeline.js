// The timeline of one case: a chart over simulated time, a table of its records, and the state after each record.
//
//   const timelines = new Timelines(packed)        the packed runs of scbm.reports.html.timelines
//   const run = await timelines.load(index)        the run of a case, null if it cannot be run again
//   const shown = showTimeline(element, run, {record, label, onSelect})
//   shown.select(index); shown.destroy()
//
// `record` is the index of the record that is selected first, `label` the name of the case, and `onSelect(index)` the
// callback for each other record that is selected. `run.failures` are the messages of failures with their records.

const { Timelines, showTimeline } = (() => {
  "use strict";

  const KEPT_BLOCKS = 4;

  /** Unpacks blocks of runs on demand; a few of them are cached. */
  class Timelines {
    #packed;
    #shared = null;
    #blocks = new Map();

    constructor(packed) {
      this.#packed = packed;
    }

    /** Returns the run of a case; null if it cannot be run again, or if there is no such case. */
    async load(index) {
      if (!(index >= 0 && index < this.#packed.cases)) return null;
      this.#shared ??= inflate(this.#packed.shared);
      const number = Math.floor(index / this.#packed.per_block);
      const [shared, block] = await Promise.all([this.#shared, this.#block(number)]);
      const packed = block.cases[index % this.#packed.per_block];
      return packed === null ? null : unpack(packed, block.steps, shared);
    }

    #block(number) {
      const found = this.#blocks.get(number) ?? inflate(this.#packed.blocks[number]);
      this.#blocks.delete(number); // reinserted at the end: the first is the least recently used
      this.#blocks.set(number, found);
      if (this.#blocks.size > KEPT_BLOCKS) this.#blocks.delete(this.#blocks.keys().next().value);
      return found;
    }
  }

  async function inflate(text) {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return JSON.parse(await new Response(stream).text());
  }

  function unpack(packed, steps, { texts, kinds, variables }) {
    let at = 0;
    let number = 0;
    const records = packed.steps.map((step, index) => {
      at += packed.after_ns[index];
      number += packed.numbers[index];
      const [kind, subject, detail, other, sentence, ...flat] = steps[step];
      const changes = [];
      for (let i = 0; i < flat.length; i += 2) changes.push({ variable: flat[i], value: texts[flat[i + 1]] });
      return {
        index,
        at,
        number,
        kind: kinds[kind],
        subject: texts[subject],
        detail: texts[detail],
        other: texts[other],
        sentence: texts[sentence].replace("{}", number),
        changes,
      };
    });
    const violations = packed.violations.map(([requirement, begins, record, atNs, reason]) => ({
      requirement: texts[requirement],
      begins,
      record,
      at: atNs,
      reason: texts[reason],
    }));
    const last = records.length - 1;
    /** Returns the spans that are packed as a flat list, each with its first and its last record. */
    const spansOf = (flat) => {
      const spans = [];
      for (let i = 0; i < flat.length; i += 3) {
        const [begin, length, outcome] = flat.slice(i, i + 3);
        spans.push({ begin: records[begin], end: records[Math.min(begin + length, last)], outcome: texts[outcome] });
      }
      return spans;
    };
    return {
      operations: spansOf(packed.operations),
      requests: spansOf(packed.requests),
      plans: spansOf(packed.plans),
      variables: variables.map(([name, , group]) => ({ name: texts[name], group })),
      nominal: variables.map(([, value]) => texts[value]),
      records,
      ended: packed.ended_ns,
      violations,
      failures: packed.failures.map(([message, record]) => ({ message: texts[message], record })),
      notes: [...packed.unused.map((text) => `no effect: ${texts[text]}`), ...packed.notes.map((text) => texts[text])],
    };
  }

  /** Returns the value of every variable after a record, in the order of the variables. */
  function stateAfter(run, index) {
    const state = [...run.nominal];
    for (const record of run.records.slice(0, index + 1)) {
      for (const { variable, value } of record.changes) state[variable] = value;
    }
    return state;
  }

  // Lanes: the rows of the chart.
  //
  // A span is {from, to, fromAt, toAt, look, label, glyph, title}: two records with their times, and the text on it:
  // `[label, short]` if there is a shorter form for narrow spans; an empty `short` shows no text. A mark is
  // {record, at, look, glyph, label, title}. Both are drawn by time or by record.

  const ENDS = { completed: "✓", failed: "✗", timedout: "!" };

  class Lane {
    spans = [];
    marks = [];
    #open = null;

    constructor(group, name) {
      this.group = group;
      this.name = name;
    }

    get isOpen() {
      return this.#open !== null;
    }

    open(record, look, label, title) {
      this.#open = { from: record.index, fromAt: record.at, look, label, title };
    }

    close(record, more) {
      if (this.#open) this.spans.push({ ...this.#open, to: record.index, toAt: record.at, ...more });
      this.#open = null;
    }

    /** Adds a span of the run. */
    add({ begin, end }, span) {
      this.spans.push({ from: begin.index, fromAt: begin.at, to: end.index, toAt: end.at, ...span });
    }

    mark(record, look, glyph, title, label = "") {
      this.marks.push({ record: record.index, at: record.at, look, glyph, title, label });
    }
  }

  /** All lanes of a run, and for each record the lane that shows it. */
  class Lanes {
    #lanes = new Map();
    #resources = new Map(); // by the number of a request
    #ofRecords = [];
    #putBack;

    constructor(run) {
      this.run = run;
      this.#putBack = new Set(run.records.filter((r) => r.kind === "put_back").map((r) => r.subject));
      for (const record of run.records) this.#ofRecords.push(this.#place(record));
      for (const span of run.operations) this.#operation(span);
      for (const span of run.requests) this.#request(span);
      this.#plans(run.plans);
      const last = run.records.at(-1);
      if (last) this.#finish(last);
      for (const violation of run.violations) this.#violation(violation);
    }

    get all() {
      const order = ["run", "operations", "resources", "automatic", "injections", "requirements"];
      const lanes = [...this.#lanes.values()];
      return order.flatMap((group) => lanes.filter((lane) => lane.group === group));
    }

    of(record) {
      return this.#ofRecords[record];
    }

    #lane(group, name) {
      const key = `${group} ${name}`;
      if (!this.#lanes.has(key)) this.#lanes.set(key, new Lane(group, name));
      return this.#lanes.get(key);
    }

    /** Returns the lane of a record, and adds its mark to it. */
    #place(record) {
      const { kind, subject } = record;
      switch (kind) {
        case "runner_started":
        case "livelocked_at_rest":
          return this.#atRest(record);
        case "run_started":
        case "run_ended":
          return this.#ofRun(record);
        case "plan_asked":
        case "plan_received":
        case "plan_dropped":
          return this.#ofPlan(record);
        case "became_current":
        case "operation":
          return this.#lane("operations", subject);
        case "automatic":
          return this.#ofAutomatic(record);
        case "request_sent":
        case "request_cancelled":
        case "reply_received":
        case "reply_dropped":
        case "message":
          return this.#ofResource(record);
        case "measurement":
        case "measurement_refused":
          return this.#ofMeasurement(record);
        case "injection":
        case "put_back":
          return this.#ofInjection(record);
        case "resource":
          return this.#ofCondition(record);
        default:
          throw new Error(`no lane for records of the kind ${kind}`);
      }
    }

    #ofRun(record) {
      const lane = this.#lane("run", "run");
      if (record.kind === "run_started") {
        lane.open(record, "run", record.subject, record.sentence);
        return lane;
      }
      const end = record.detail.replace("_", " ");
      const good = record.detail === "reached";
      this.#finish(record, lane);
      lane.close(record, { label: `${record.subject}: ${end}`, look: good ? "reached" : "not-reached" });
      lane.mark(record, good ? "reached" : "not-reached", "■", record.sentence);
      return lane;
    }

    #atRest(record) {
      const lane = this.#lane("run", "run");
      const begins = record.kind === "runner_started";
      lane.mark(record, begins ? "begins" : "not-reached", begins ? "○" : "■", record.sentence);
      return lane;
    }

    /** Closes the spans of injections, and that of the run, when the run ends. */
    #finish(record, but) {
      for (const lane of this.#lanes.values()) if (lane !== but) lane.close(record);
    }

    #ofPlan(record) {
      const lane = this.#lane("run", "plan");
      if (record.kind === "plan_dropped") lane.mark(record, "dropped", "◁", record.sentence);
      if (record.kind === "plan_received" && record.detail !== "solved") lane.mark(record, "not-reached", "✗", record.sentence);
      return lane;
    }

    #plans(spans) {
      const asked = (span) => span.begin.kind === "plan_asked";
      let number = 0;
      for (const span of spans.filter((each) => asked(each) || each.outcome === "solved")) {
        const { other, sentence } = span.begin;
        if (!asked(span)) number += 1;
        const look = asked(span) ? "planning" : number % 2 ? "plan" : "plan other";
        const label = asked(span) ? "planning" : [`${number}: ${counted(other, "operation")}`, number];
        this.#lane("run", "plan").add(span, { look, label, title: sentence });
      }
    }

    #operation(span) {
      const { begin, end, outcome } = span;
      const isDisabled = begin.detail === "disabled";
      const look = outcome === "" ? "stopped" : isDisabled ? "disabled" : outcome;
      const by = end.kind === "operation" ? look : `failed by ${end.subject}`;
      const how = { stopped: "when the run ended", timedout: "timed out", disabled: outcome === "initial" ? "given up" : "disabled" }[look];
      const label = { failed: ["failed", ""], timedout: ["timed out", ""], stopped: ["stopped", ""], disabled: ["disabled", ""] }[look];
      const title = `${begin.subject}: ${how ?? by}`;
      this.#lane("operations", begin.subject).add(span, { look, glyph: ENDS[look], label, title });
    }

    #ofAutomatic(record) {
      const lane = this.#lane("automatic", "automatic transitions");
      lane.mark(record, record.other ? "failed" : "automatic", "◆", record.sentence, record.subject);
      return lane;
    }

    #ofResource(record) {
      const name = record.subject || this.#resources.get(record.number) || "unknown";
      const lane = this.#lane("resources", name);
      const { kind, number } = record;
      if (kind === "request_sent") this.#resources.set(number, name);
      if (["request_sent", "request_cancelled", "reply_received"].includes(kind)) return lane;
      if (kind === "reply_dropped") lane.mark(record, "dropped", "◁", record.sentence, `reply ${number} ${record.detail}`);
      else if (record.other === "0") lane.mark(record, "message", "∅", record.sentence, `${record.detail} ${number} lost`);
      else lane.mark(record, "message", `×${record.other}`, record.sentence, `${record.detail} ${number}`);
      return lane;
    }

    #request(span) {
      const { subject, detail, number } = span.begin;
      const look = span.outcome === "no reply" ? "unanswered" : span.outcome;
      const glyph = { cancelled: "⊘", failed: "✗", succeeded: "✓" }[look];
      const title = `request ${number}: ${detail}`;
      this.#lane("resources", subject).add(span, { look, glyph, label: [`${number} ${detail}`, number], title });
    }

    #ofMeasurement(record) {
      const lane = this.#lane("resources", "measured values");
      const refused = record.kind === "measurement_refused";
      lane.mark(record, refused ? "dropped" : "automatic", refused ? "◁" : "◆", record.sentence);
      return lane;
    }

    #ofInjection(record) {
      const lane = this.#lane("injections", record.subject);
      if (record.kind === "put_back") {
        if (lane.isOpen) lane.close(record, { glyph: "↩" });
        else lane.mark(record, "injected", "↩", record.sentence);
      } else {
        if (this.#putBack.has(record.subject)) lane.open(record, "injected", ["⚡ held", "⚡"], record.sentence);
        else lane.mark(record, "injected", "⚡", record.sentence);
      }
      return lane;
    }

    /** The first record of an injection begins a condition, the second puts it back; restarts may overlap. */
    #ofCondition(record) {
      const { subject, detail, other } = record;
      const lane = this.#lane("injections", subject === "network" ? `network: ${other}` : subject);
      if (lane.isOpen && detail !== "down") {
        lane.close(record, { glyph: "↩" });
      } else if (lane.isOpen) lane.mark(record, "injected", "⚡", record.sentence);
      else lane.open(record, "injected", [`⚡ ${other} is ${detail}`, "⚡"], record.sentence);
      return lane;
    }

    #violation({ requirement, begins, record, at, reason }) {
      const lane = this.#lane("requirements", requirement);
      const title = `${requirement}: ${reason}`;
      const from = this.run.records[begins];
      lane.spans.push({ from: begins, fromAt: from.at, to: record, toAt: at, look: "violated", label: "", title });
      lane.marks.push({ record, at, look: "violated", glyph: "✗", title, label: reason });
    }
  }

  /** Returns a lane with the values of one variable. */
  function valuesLane(run, variable) {
    const lane = new Lane("values", run.variables[variable].name);
    let last = null;
    for (const record of run.records) {
      const change = record.changes.findLast((c) => c.variable === variable);
      const value = change?.value ?? (last === null ? run.nominal[variable] : undefined);
      if (value === undefined || value === last) continue;
      last = value;
      lane.close(record);
      lane.open(record, lane.spans.length % 2 ? "value other" : "value", value, `${lane.name} = ${value}`);
    }
    if (run.records.length) lane.close(run.records.at(-1));
    return lane;
  }

  // Formats of time.

  const SECOND = 1e9;
  const MINUTE = 60 * SECOND;
  const HOUR = 60 * MINUTE;

  const TICKS = [];
  for (let size = 1; size < SECOND; size *= 10) TICKS.push(size, 2 * size, 5 * size);
  TICKS.push(...[1, 2, 5, 10, 15, 30].map((n) => n * SECOND), ...[1, 2, 5, 10, 15, 30].map((n) => n * MINUTE));
  for (let size = 1; size < 1e5; size *= 10) TICKS.push(size * HOUR, 2 * size * HOUR, 5 * size * HOUR);

  /** Returns a time with the precision that ticks `step` apart need. */
  function formatTick(at, step) {
    if (at === 0) return "0 s";
    if (at >= MINUTE) return formatClock(at, step);
    if (step >= SECOND / 1000 && (at >= SECOND || step >= SECOND / 10)) return decimal(at, SECOND, step, "s");
    if (step >= 1000 || at >= SECOND / 1000) return decimal(at, SECOND / 1000, step, "ms");
    return decimal(at, 1000, step, "µs");
  }

  function decimal(at, unit, step, name) {
    const digits = Math.max(0, Math.ceil(Math.log10(unit / step) - 1e-9));
    return `${(at / unit).toFixed(digits)} ${name}`;
  }

  /** `1:05 min`, `2:03:00 h`, `12 min`, `3 h`. */
  function formatClock(at, step) {
    const hours = Math.floor(at / HOUR);
    const minutes = Math.floor((at % HOUR) / MINUTE);
    const digits = step >= SECOND ? 0 : Math.ceil(Math.log10(SECOND / step) - 1e-9);
    const seconds = ((at % MINUTE) / SECOND).toFixed(digits).padStart(digits ? digits + 3 : 2, "0");
    const two = String(minutes).padStart(2, "0");
    if (!hours) return step >= MINUTE ? `${minutes} min` : `${minutes}:${seconds} min`;
    if (step >= HOUR) return `${hours} h`;
    return step >= MINUTE ? `${hours}:${two} h` : `${hours}:${two}:${seconds} h`;
  }

  const counted = (count, name) => `${count} ${name}${Number(count) === 1 ? "" : "s"}`;

  const inSeconds = (at) => `${(at / SECOND).toFixed(3)} s`;

  /** Returns a time in seconds with all digits: the exact time of a record. */
  function exactly(at) {
    const digits = String(at).padStart(10, "0");
    const seconds = `${digits.slice(0, -9)}.${digits.slice(-9).replace(/0{1,6}$/, "")} s`;
    return at >= MINUTE ? `${seconds} (${formatClock(at, SECOND)})` : seconds;
  }

  // Elements of the page.

  function html(tag, properties = {}, ...children) {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(properties)) {
      if (name in element) element[name] = value;
      else element.setAttribute(name, value);
    }
    element.append(...children);
    return element;
  }

  function svg(tag, attributes = {}, ...children) {
    const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.append(...children);
    return element;
  }

  const measuring = document.createElement("canvas").getContext("2d");

  function textWidth(text, font) {
    measuring.font = font;
    return measuring.measureText(text).width;
  }

  /** Returns the text, cut at its end to a width. */
  function fitted(text, width, font) {
    if (textWidth(text, font) <= width) return text;
    let [short, long] = [0, text.length];
    while (long - short > 1) {
      const middle = (short + long) >> 1;
      if (textWidth(`${text.slice(0, middle)}…`, font) <= width) short = middle;
      else long = middle;
    }
    return short ? `${text.slice(0, short)}…` : "";
  }

  const TAIL = 9;

  /** Returns a name, cut in its middle to a width: names often differ at their ends only. */
  function fittedName(name, width, font) {
    if (textWidth(name, font) <= width) return name;
    const tail = name.slice(-TAIL);
    return fitted(name.slice(0, -TAIL), width - textWidth(tail, font), font) + tail;
  }

  // The chart.

  const LANE = 26;
  const NARROW_LANE = 40; // with the name above the bars
  const NARROW = 620;
  const BAR = 16;
  const BELOW = 16; // for what went wrong with messages, below the requests
  const HEADING = 20;
  const AXIS = 24;
  const MAP = 18;
  const NEAR = 11; // marks that are nearer are one, with their number
  const SMALLEST = 3;
  const LABEL = 12;
  const BAD = ["failed", "timedout", "unanswered", "cancelled"];
  const HEADINGS = {
    operations: "Operations",
    resources: "Requests to resources",
    automatic: "Automatic transitions",
    injections: "Injections",
    requirements: "Violated requirements",
    values: "Variables",
  };
  const LEGEND = [
    ["completed", "✓ completed, succeeded", ["completed", "succeeded"]],
    ["failed", "✗ failed", ["failed"]],
    ["timedout", "! timed out", ["timedout"]],
    ["disabled", "disabled", ["disabled"]],
    ["stopped", "stopped by the end of the run", ["stopped"]],
    ["cancelled", "⊘ cancelled", ["cancelled"]],
    ["unanswered", "not answered", ["unanswered"]],
    ["dropped", "◁ reply dropped", ["dropped"]],
    ["message", "∅ message lost, ×2 doubled", ["message"]],
    ["injected", "⚡ injected, ↩ put back", ["injected"]],
    ["violated", "violated, from its first record to ✗", ["violated"]],
  ];
  const PATTERNS = {
    failed: "M0 0 L8 8 M8 0 L0 8",
    timedout: "M-2 2 L2 -2 M0 8 L8 0 M6 10 L10 6",
    injected: "M0 4 H8",
    violated: "M4 0 V8",
  };

  class Chart {
    static #count = 0;

    #run;
    #lanes;
    #all;
    #rows = [];
    #values = new Map();
    #byTime;
    #view;
    #selected = 0;
    #onSelect;
    #hits = new Map(); // the records of a part of the picture
    #parts = new Map(); // the parts of a record
    #prefix;
    #frame = 0;
    #observer;
    #width = 0;
    #drag = null;

    constructor(run, onSelect) {
      this.#run = run;
      this.#lanes = new Lanes(run);
      this.#all = this.#lanes.all;
      this.#onSelect = onSelect;
      this.#byTime = run.ended > 0;
      this.#prefix = `timeline-${(Chart.#count += 1)}`;
      this.#view = this.#whole();
      this.axis = svg("svg", { class: "tl-axis", "aria-hidden": "true" });
      this.picture = svg("svg", { class: "tl-lanes", role: "img", "aria-label": this.#description() });
      const label = "The run over time. Left and right step through its records, plus and minus zoom.";
      this.box = html("div", { className: "tl-chart", tabIndex: 0, role: "group", "aria-label": label });
      this.box.append(this.axis, this.picture);
      this.map = svg("svg", { class: "tl-map", "aria-hidden": "true" });
      this.legend = html("ul", { className: "tl-legend", "aria-label": "What marks mean" });
      this.#listen();
      this.#fillLegend();
      this.#observer = new ResizeObserver(() => this.redraw());
      this.#observer.observe(this.box);
    }

    destroy() {
      this.#observer.disconnect();
      cancelAnimationFrame(this.#frame);
    }

    get byTime() {
      return this.#byTime;
    }

    get canBeByTime() {
      return this.#run.ended > 0;
    }

    get isWhole() {
      const [from, to] = this.#whole();
      return this.#view[0] <= from && this.#view[1] >= to;
    }

    #description() {
      const names = this.#all.map((lane) => lane.name).join(", ");
      return `${this.#run.records.length} records in ${inSeconds(this.#run.ended)}, on the lanes ${names}.`;
    }

    #fillLegend() {
      const looks = new Set(this.#all.flatMap((l) => [...l.spans, ...l.marks].flatMap((s) => s.look.split(" "))));
      for (const [look, words, shownFor] of LEGEND) {
        if (!shownFor.some((l) => looks.has(l))) continue;
        const sample = svg("svg", { width: 26, height: 14, "aria-hidden": "true" });
        if (!["dropped", "message"].includes(look)) this.#bar(sample, look, 1, 1, 24, 12);
        this.legend.append(html("li", {}, ...(sample.childNodes.length ? [sample] : []), words));
      }
    }

    // the visible range

    #whole() {
      if (!this.#byTime) return [-0.7, Math.max(this.#run.records.length - 0.3, 0.7)];
      return [-0.01 * this.#run.ended, 1.01 * this.#run.ended];
    }

    #value(record, at = this.#run.records[record].at) {
      return this.#byTime ? at : record;
    }

    show(from, to) {
      const [first, last] = this.#whole();
      const size = Math.min(Math.max(to - from, this.#byTime ? 1000 : 4), last - first);
      const begin = Math.min(Math.max(from, first), last - size);
      this.#view = [begin, begin + size];
      this.redraw();
    }

    fit() {
      this.show(...this.#whole());
    }

    /** Zooms in by a factor; the point `at` keeps its position. */
    zoom(factor, at = this.#middle()) {
      const [from, to] = this.#view;
      this.show(at - (at - from) / factor, at + (to - at) / factor);
    }

    #middle() {
      const selected = this.#run.records.length ? this.#value(this.#selected) : 0;
      const [from, to] = this.#view;
      return selected >= from && selected <= to ? selected : (from + to) / 2;
    }

    pan(share) {
      const [from, to] = this.#view;
      this.show(from + share * (to - from), to + share * (to - from));
    }

    measure(byTime) {
      this.#byTime = byTime && this.canBeByTime;
      this.fit();
    }

    select(record) {
      this.#selected = record;
      const value = this.#value(record);
      const [from, to] = this.#view;
      const edge = this.isWhole ? 0 : 0.03 * (to - from);
      if (value < from + edge || value > to - edge) this.show(value - (to - from) / 2, value + (to - from) / 2);
      else if (this.#width && !this.#frame) this.#point();
    }

    /** Shows or hides the lane of a variable; returns whether it is shown now. */
    toggle(variable) {
      const shown = !this.#values.delete(variable);
      if (shown) this.#values.set(variable, valuesLane(this.#run, variable));
      this.draw();
      if (shown) this.box.scrollTop = this.box.scrollHeight;
      return shown;
    }

    // pointers

    #listen() {
      this.box.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
      this.box.addEventListener("pointerdown", (event) => this.#press(event));
      this.box.addEventListener("pointermove", (event) => this.#move(event));
      for (const end of ["pointerup", "pointercancel"]) this.box.addEventListener(end, () => this.#release());
      this.box.addEventListener("click", (event) => this.#click(event));
      const jump = (event) => {
        if (event.buttons !== 1) return;
        const [first, last] = this.#whole();
        const { left, width } = this.map.getBoundingClientRect();
        const at = first + ((event.clientX - left) / width) * (last - first);
        const half = (this.#view[1] - this.#view[0]) / 2;
        this.show(at - half, at + half);
      };
      this.map.addEventListener("pointerdown", (event) => {
        this.map.setPointerCapture(event.pointerId);
        jump(event);
      });
      this.map.addEventListener("pointermove", jump);
    }

    #wheel(event) {
      const sideways = event.shiftKey ? event.deltaY : event.deltaX;
      if (event.ctrlKey || event.metaKey) this.zoom(Math.exp(-event.deltaY / 300), this.#valueAt(event.clientX));
      else if (sideways && !this.isWhole) this.pan(sideways / this.#plot);
      else return;
      event.preventDefault();
    }

    #press(event) {
      if (event.button === 0) this.#drag = { x: event.clientX, view: this.#view, moved: false };
    }

    #move(event) {
      const drag = this.#drag;
      if (!drag || (!drag.moved && Math.abs(event.clientX - drag.x) < 5)) return;
      if (!drag.moved) this.box.setPointerCapture(event.pointerId);
      drag.moved = true;
      const moved = ((drag.x - event.clientX) / this.#plot) * (drag.view[1] - drag.view[0]);
      this.show(drag.view[0] + moved, drag.view[1] + moved);
    }

    #release() {
      const drag = this.#drag;
      this.#drag = null;
      if (drag?.moved) this.#dragged = true;
    }

    #dragged = false; // the click that follows a drag selects nothing

    #click(event) {
      if (this.#dragged) {
        this.#dragged = false;
        return;
      }
      const hit = event.target.closest("[data-record]");
      const records = hit && this.#hits.get(hit);
      if (records) this.#onSelect(records.find((record) => record > this.#selected) ?? records[0]);
      else if (this.#run.records.length) this.#onSelect(this.#nearest(this.#valueAt(event.clientX)));
    }

    #valueAt(clientX) {
      const x = clientX - this.picture.getBoundingClientRect().left - this.#gutter;
      return this.#view[0] + (x / this.#plot) * (this.#view[1] - this.#view[0]);
    }

    #nearest(value) {
      let found = 0;
      const far = (record) => Math.abs(this.#value(record) - value);
      for (const { index } of this.#run.records) if (far(index) < far(found)) found = index;
      return found;
    }

    // drawing

    #gutter = 0;
    #plot = 1;
    #font = "";

    redraw() {
      this.#frame ||= requestAnimationFrame(() => this.draw());
    }

    draw() {
      cancelAnimationFrame(this.#frame);
      this.#frame = 0;
      this.#layOut();
      if (this.#width <= 0) return;
      this.#hits.clear();
      this.#parts.clear();
      this.#drawAxis();
      const parts = [this.#patterns(), this.#grid()];
      for (const row of this.#rows) parts.push(row.lane ? this.#drawLane(row) : this.#drawHeading(row));
      this.#cursor = svg("g", {});
      this.#flag = svg("path", { class: "tl-flag" });
      this.axis.append(this.#flag);
      this.picture.replaceChildren(...parts, this.#cursor);
      this.#drawMap();
      this.#point();
    }

    // Selecting a record redraws only the marks of the selection.

    #cursor = svg("g", {});
    #flag = svg("path", {});
    #on = [];

    #point() {
      for (const part of this.#on) part.classList.remove("on");
      this.#on = this.#parts.get(this.#selected) ?? [];
      for (const part of this.#on) part.classList.add("on");
      this.#drawCursor();
      this.#keepInSight();
    }

    #layOut() {
      this.#width = this.box.clientWidth;
      const style = getComputedStyle(this.box);
      this.#font = `${LABEL}px ${style.fontFamily}`;
      const narrow = this.#width < NARROW;
      const lanes = [...this.#all, ...this.#values.values()];
      const widest = Math.max(0, ...lanes.map((lane) => textWidth(lane.name, this.#font)));
      this.#gutter = narrow ? 8 : Math.min(Math.max(widest + 18, 80), 0.28 * this.#width);
      this.#plot = Math.max(this.#width - this.#gutter - 12, 1);
      this.#rows = [];
      let y = 2;
      let group = "run";
      for (const lane of lanes) {
        if (lane.group !== group) {
          group = lane.group;
          this.#rows.push({ heading: HEADINGS[group], y, height: HEADING });
          y += HEADING;
        }
        const below = lane.group === "resources" && lane.spans.length && lane.marks.length ? BELOW : 0;
        const height = (narrow ? NARROW_LANE : LANE) + below;
        const middle = narrow ? y + 28 : y + LANE / 2;
        this.#rows.push({ lane, y, height, middle, marksAt: middle + below, narrow });
        y += height;
      }
      this.height = y + 4;
      for (const [picture, height] of [[this.axis, AXIS], [this.picture, this.height], [this.map, MAP]]) {
        picture.setAttribute("viewBox", `0 0 ${this.#width} ${height}`);
        picture.setAttribute("width", this.#width);
        picture.setAttribute("height", height);
      }
    }

    #x(value) {
      const [from, to] = this.#view;
      return this.#gutter + ((value - from) / (to - from)) * this.#plot;
    }

    get #right() {
      return this.#gutter + this.#plot;
    }

    #ticks() {
      return this.#byTime ? this.#timeTicks() : this.#recordTicks();
    }

    #timeTicks() {
      const [from, to] = this.#view;
      const least = ((to - from) / this.#plot) * 90;
      const step = TICKS.find((size) => size >= least) ?? TICKS.at(-1);
      const ticks = [];
      const last = Math.min(to, this.#run.ended);
      for (let at = Math.ceil(Math.max(from, 0) / step) * step; at <= last; at += step) {
        ticks.push([at, formatTick(at, step)]);
      }
      return ticks;
    }

    /** Drawn by record, a tick stands where time passes, and has the time. */
    #recordTicks() {
      const [from, to] = this.#view;
      const ticks = [];
      let end = -Infinity;
      for (const { index, at } of this.#run.records) {
        if (index < from || index > to || (index && this.#run.records[index - 1].at === at)) continue;
        const words = inSeconds(at);
        const x = this.#x(index);
        const fits = x > end;
        if (fits) end = x + textWidth(words, this.#font) + 14;
        ticks.push([index, fits ? words : ""]);
      }
      return ticks.length > 1 ? ticks : this.#numberTicks();
    }

    /** Where no time passes, ticks have the numbers of records. */
    #numberTicks() {
      const [from, to] = this.#view;
      const least = Math.max(((to - from) / this.#plot) * 90, 1);
      const step = TICKS.find((size) => size >= least);
      const ticks = [];
      for (let number = Math.max(step, Math.ceil((from + 1) / step) * step); number - 1 <= to; number += step) {
        if (number <= this.#run.records.length) ticks.push([number - 1, `record ${number}`]);
      }
      return ticks;
    }

    #drawAxis() {
      const parts = [];
      let end = -Infinity; // of the words so far: those at the rims are moved inwards, and none may touch
      for (const [value, words] of this.#ticks()) {
        const x = this.#x(value);
        parts.push(svg("line", { class: "tl-tick", x1: x, x2: x, y1: AXIS - 5, y2: AXIS }));
        if (!words) continue;
        const width = textWidth(words, this.#font);
        const middle = Math.min(Math.max(x, this.#gutter + width / 2), this.#right - width / 2 + 8);
        if (middle - width / 2 < end + 8) continue;
        end = middle + width / 2;
        parts.push(svg("text", { class: "tl-words", x: middle, y: AXIS - 9, "text-anchor": "middle" }, words));
      }
      this.axis.replaceChildren(...parts);
    }

    #grid() {
      const lines = this.#ticks().map(([value]) => {
        const x = this.#x(value);
        return svg("line", { class: "tl-grid", x1: x, x2: x, y1: 0, y2: this.height });
      });
      return svg("g", {}, ...lines);
    }

    #patterns() {
      const patterns = Object.entries(PATTERNS).map(([look, way]) => {
        const attributes = { id: `${this.#prefix}-${look}`, width: 8, height: 8, patternUnits: "userSpaceOnUse" };
        return svg("pattern", attributes, svg("path", { class: `tl-pattern ${look}`, d: way }));
      });
      return svg("defs", {}, ...patterns);
    }

    #drawHeading({ heading, y, height }) {
      const line = svg("line", { class: "tl-group", x1: 0, x2: this.#width, y1: y + 2, y2: y + 2 });
      return svg("g", {}, line, svg("text", { class: "tl-heading", x: 4, y: y + height - 4 }, heading));
    }

    #drawLane(row) {
      const { lane, y, middle, narrow } = row;
      const space = narrow ? this.#width - 12 : this.#gutter - 12;
      const name = svg("text", { class: "tl-name", x: 4, y: narrow ? y + 13 : middle + 4 });
      name.append(svg("title", {}, lane.name), fittedName(lane.name, space, this.#font));
      const base = svg("line", { class: "tl-base", x1: this.#gutter, x2: this.#right, y1: middle, y2: middle });
      return svg("g", { class: `tl-lane ${lane.group}`, "data-name": lane.name }, name, base, ...this.#bars(row), ...this.#marks(row));
    }

    #bars({ lane, middle }) {
      const parts = [];
      const ends = { true: -Infinity, false: -Infinity };
      for (const span of lane.spans) {
        const [from, to] = [this.#x(this.#value(span.from, span.fromAt)), this.#x(this.#value(span.to, span.toAt))];
        if (to < this.#gutter || from > this.#right) continue;
        const x = Math.max(from, this.#gutter - 2);
        const width = Math.max(Math.min(to, this.#right + 2) - x, SMALLEST);
        const bad = BAD.includes(span.look);
        if (width <= SMALLEST && x < ends[bad]) continue; // thousands of short spans overlap; failed ones stay visible
        ends[bad] = x + width;
        const part = svg("g", { class: `tl-bar ${span.look}`, "data-record": span.from });
        part.append(svg("title", {}, this.#tooltip(span)));
        this.#bar(part, span.look, x, middle - BAR / 2, width, BAR);
        this.#words(part, span, x, middle, width);
        this.#bind(part, span.from === span.to ? [span.from] : [span.from, span.to]);
        parts.push(part);
      }
      return parts;
    }

    #bar(parent, look, x, y, width, height) {
      const pattern = Object.keys(PATTERNS).find((name) => look.split(" ").includes(name));
      const place = { x, y, width, height, rx: Math.min(3, width / 2) };
      parent.append(svg("rect", { ...place, class: `tl-body ${look}` }));
      if (pattern) parent.append(svg("rect", { ...place, fill: `url(#${this.#prefix}-${pattern})` }));
    }

    #words(part, { label, glyph, look }, x, middle, width) {
      let space = width - 8;
      if (glyph && width > 14) {
        const mark = svg("text", { class: `tl-glyph ${look}`, x: x + width - 4, y: middle + 4, "text-anchor": "end" });
        mark.append(glyph);
        part.append(mark);
        space -= 14;
      }
      const words = space > 6 ? this.#readable(label, space) : "";
      if (words) part.append(svg("text", { class: "tl-words", x: x + 5, y: middle + 4 }, words));
    }

    /** Returns the text that fits: the label, its beginning if enough is left, the short form, or nothing. */
    #readable(label, space) {
      if (!label) return "";
      const [long, short] = Array.isArray(label) ? label.map(String) : [label, null];
      const words = fitted(long, space, this.#font);
      const least = short === "" ? long.length : Math.max(5, (short ?? "").length + 5);
      if (words === long || words.length >= least) return words;
      return short && fitted(short, space, this.#font) === short ? short : "";
    }

    /** Makes a part of the chart select its records: each click selects the next one. */
    #bind(part, records) {
      this.#hits.set(part, records);
      for (const record of records) {
        if (!this.#parts.has(record)) this.#parts.set(record, []);
        this.#parts.get(record).push(part);
      }
    }

    #tooltip({ title, label, fromAt, toAt }) {
      const lasts = formatTick(toAt - fromAt, 1e6);
      return `${title || label}\n${inSeconds(fromAt)} to ${inSeconds(toAt)}, ${lasts}`;
    }

    #marks({ lane, marksAt }) {
      const clusters = [];
      for (const mark of lane.marks) {
        const x = this.#x(this.#value(mark.record, mark.at));
        if (x < this.#gutter - 4 || x > this.#right + 4) continue;
        const last = clusters.at(-1);
        const free = last ? last.x + NEAR + (last.marks[0].glyph.length > 1 ? 6 : 0) : x;
        const same = last?.marks[0].glyph === mark.glyph;
        if (x >= free) clusters.push({ x, marks: [mark] });
        else if (same || free - x > NEAR) last.marks.push(mark);
        else clusters.push({ x: free, marks: [mark] }); // beside another sort of mark, a bit late
      }
      return clusters.map((cluster, index) => this.#drawMark(cluster, clusters[index - 1], clusters[index + 1], marksAt));
    }

    #drawMark({ x, marks }, previous, next, middle) {
      const first = marks[0];
      const records = marks.map((mark) => mark.record);
      const part = svg("g", { class: `tl-mark ${first.look}`, "data-record": first.record });
      const more = marks.length > 1 ? `\nand ${marks.length - 1} more` : "";
      part.append(svg("title", {}, `${first.title}\n${inSeconds(first.at)}${more}`));
      part.append(svg("circle", { class: "tl-hit", cx: x, cy: middle, r: 9 }));
      part.append(svg("text", { class: `tl-glyph ${first.look}`, x, y: middle + 4, "text-anchor": "middle" }, first.glyph));
      const words = marks.length > 1 ? `(${marks.length})` : (first.label ?? "");
      const after = (next?.x ?? this.#width) - x - 20;
      const before = previous ? 0 : x - this.#gutter - 12;
      const leftwards = words && !next && textWidth(words, this.#font) > after && before > after;
      const shortened = words && fitted(words, leftwards ? before : after, this.#font);
      const place = leftwards ? { x: x - 9, "text-anchor": "end" } : { x: x + 9 };
      if (shortened && (shortened === words || shortened.length > 4)) {
        part.append(svg("text", { class: "tl-words", y: middle + 4, ...place }, shortened));
      }
      this.#bind(part, records);
      return part;
    }

    #drawCursor() {
      this.#cursor.replaceChildren();
      this.#flag.setAttribute("d", "");
      if (!this.#run.records.length) return;
      const x = this.#x(this.#value(this.#selected));
      if (x < this.#gutter - 3 || x > this.#right + 3) return;
      this.#cursor.append(svg("line", { class: "tl-cursor", x1: x, x2: x, y1: 0, y2: this.height }));
      this.#flag.setAttribute("d", `M${x - 5} ${AXIS - 7} h10 l-5 7 z`);
      const row = this.#rows.find(({ lane }) => lane && lane === this.#lanes.of(this.#selected));
      if (!row) return;
      const isMark = row.lane.marks.some((mark) => mark.record === this.#selected);
      this.#cursor.append(svg("circle", { class: "tl-ring", cx: x, cy: isMark ? row.marksAt : row.middle, r: 6 }));
    }

    #drawMap() {
      this.map.classList.toggle("whole", this.isWhole);
      if (this.isWhole) return;
      const [first, last] = this.#whole();
      const x = (value) => ((value - first) / (last - first)) * this.#width;
      const parts = [];
      let end = -Infinity;
      for (const lane of this.#all.filter(({ group }) => group === "operations" || group === "automatic")) {
        for (const span of lane.spans) {
          const from = x(this.#value(span.from, span.fromAt));
          const width = Math.max(x(this.#value(span.to, span.toAt)) - from, 1);
          parts.push(svg("rect", { class: `tl-body ${span.look}`, x: from, y: 5, width, height: MAP - 10 }));
        }
        end = -Infinity;
        for (const mark of lane.marks) {
          const at = x(this.#value(mark.record, mark.at));
          if (at - end < 2) continue;
          end = at;
          parts.push(svg("rect", { class: "tl-dot", x: at, y: MAP - 4, width: 1.5, height: 3 }));
        }
      }
      const [from, to] = this.#view.map(x);
      const place = { x: from, y: 1, width: Math.max(to - from, 4), height: MAP - 2, rx: 3 };
      this.map.replaceChildren(...parts, svg("rect", { class: "tl-window", ...place }));
    }

    /** Returns the row of the selected record: that of a requirement that it violates, else that of its own lane. */
    #rowOfSelected() {
      const isViolated = ({ lane }) => lane?.group === "requirements" && lane.marks.some(({ record }) => record === this.#selected);
      return this.#rows.find(isViolated) ?? this.#rows.find(({ lane }) => lane && lane === this.#lanes.of(this.#selected));
    }

    /** Returns the upper and the lower edge of the selected record's lane, in the window. */
    laneOfSelected() {
      const row = this.#rowOfSelected();
      const { top } = this.picture.getBoundingClientRect();
      return row ? { top: top + row.y, bottom: top + row.y + row.height } : { top, bottom: top };
    }

    #shownRecord = -1;

    /** Scrolls to the lane of the selected record. */
    #keepInSight() {
      if (this.#shownRecord === this.#selected || this.box.scrollHeight <= this.box.clientHeight + 1) return;
      this.#shownRecord = this.#selected;
      const row = this.#rowOfSelected();
      if (!row) return;
      const top = row.y - 20;
      const bottom = AXIS + row.y + row.height + 10 - this.box.clientHeight;
      if (this.box.scrollTop > top) this.box.scrollTop = top;
      else if (this.box.scrollTop < bottom) this.box.scrollTop = bottom;
    }
  }

  // The records as a table. Rows are created in chunks, when they come into view.

  const CHUNK = 250;

  class RecordTable {
    #run;
    #rows = [];
    #chunks = [];
    #selected = null;
    #observer;

    constructor(run, onSelect) {
      this.#run = run;
      const heads = ["#", "time", "what happened", "changes"].map((name) => html("th", { scope: "col" }, name));
      this.table = html("table", {}, html("thead", {}, html("tr", {}, ...heads)));
      this.box = html("div", { className: "tl-records", tabIndex: 0, role: "group", "aria-label": "All records" }, this.table);
      this.#observer = new IntersectionObserver((seen) => this.#seen(seen), { root: this.box, rootMargin: "600px" });
      for (let from = 0; from < run.records.length; from += CHUNK) this.#chunk(from);
      this.#fill(0);
      this.table.addEventListener("click", (event) => {
        const row = event.target.closest("tr[data-record]");
        if (row && !String(getSelection())) onSelect(Number(row.dataset.record));
      });
    }

    destroy() {
      this.#observer.disconnect();
    }

    #chunk(from) {
      const count = Math.min(CHUNK, this.#run.records.length - from);
      const cell = html("td", { colSpan: 4 });
      cell.style.height = `${27 * count}px`;
      const body = html("tbody", {}, html("tr", {}, cell));
      this.#chunks.push({ body, from, count, filled: false });
      this.table.append(body);
      this.#observer.observe(body);
    }

    #seen(entries) {
      for (const { isIntersecting, target } of entries) {
        if (isIntersecting) this.#fill(this.#chunks.findIndex(({ body }) => body === target));
      }
    }

    #fill(number) {
      const chunk = this.#chunks[number];
      if (!chunk || chunk.filled) return;
      chunk.filled = true;
      this.#observer.unobserve(chunk.body);
      const rows = [];
      for (let index = chunk.from; index < chunk.from + chunk.count; index += 1) rows.push(this.#row(index));
      chunk.body.replaceChildren(...rows);
    }

    fillAll() {
      for (const number of this.#chunks.keys()) this.#fill(number);
    }

    #row(index) {
      const record = this.#run.records[index];
      const same = index > 0 && this.#run.records[index - 1].at === record.at;
      const time = html("td", { className: same ? "tl-time same" : "tl-time", title: exactly(record.at) }, inSeconds(record.at));
      const what = html("td", {}, record.sentence);
      for (const { record: at, requirement, reason } of this.#run.violations) {
        if (at === index) what.append(html("strong", { className: "tl-broken", "data-requirement": requirement }, `✗ ${requirement}: ${reason}`));
      }
      const changes = html("td", { className: "tl-changes" }, ...changesOf(this.#run, record));
      const row = html("tr", { className: lookOf(record) }, html("td", { className: "tl-number" }, String(index + 1)), time, what, changes);
      row.dataset.record = index;
      this.#rows[index] = row;
      return row;
    }

    select(index) {
      this.#fill(Math.floor(index / CHUNK));
      this.#selected?.classList.remove("selected");
      this.#selected?.removeAttribute("aria-current");
      const row = (this.#selected = this.#rows[index]);
      row.classList.add("selected");
      row.setAttribute("aria-current", "true");
      const head = this.table.tHead.offsetHeight;
      const { box } = this;
      if (row.offsetTop < box.scrollTop + head) box.scrollTop = row.offsetTop - head;
      const bottom = row.offsetTop + row.offsetHeight - box.clientHeight;
      if (bottom > box.scrollTop) box.scrollTop = bottom;
    }
  }

  /** Returns an element for each change of a record; variables of the runner are less prominent. */
  function changesOf(run, record, before = null) {
    return record.changes.map(({ variable, value }) => {
      const { name, group } = run.variables[variable];
      const text = before ? `${name}: ${before[variable]} → ${value}` : `${name} = ${value}`;
      return html("span", { className: `tl-change ${group}` }, text);
    });
  }

  /** Returns the CSS class that highlights a record. */
  function lookOf({ kind, detail, other }) {
    if (kind === "operation" && detail in ENDS) return detail;
    if (kind === "operation" && detail === "disabled") return "disabled";
    if (kind === "run_ended") return detail === "reached" ? "completed" : "failed";
    if (kind === "reply_received" && detail === "failed") return "failed";
    if (kind === "automatic" && other) return "failed";
    return ["injection", "put_back", "resource"].includes(kind) ? "injected" : "";
  }

  // The state after the selected record.

  const GROUPS = ["variables", "resources", "operations", "runner"];
  const GROUP_NAMES = { variables: "Variables", resources: "Requests", operations: "Operations", runner: "Runner" };

  class StatePanel {
    #run;
    #rows = [];
    #tables = [];
    #index = 0;

    constructor(run, onToggle) {
      this.#run = run;
      this.changedOnly = html("input", { type: "checkbox" });
      this.filter = html("input", { type: "search", placeholder: "name", "aria-label": "Show variables with this in their name" });
      this.note = html("p", { className: "tl-note" });
      const groups = GROUPS.map((group) => this.#table(group, onToggle)).filter((table) => table !== null);
      const only = html("label", {}, this.changedOnly, " changed only");
      const head = html("div", { className: "tl-head" }, html("h3", {}, "State"), only, this.filter);
      this.box = html("section", { className: "tl-state", "aria-label": "State" }, head, this.note, html("div", { className: "tl-groups" }, ...groups));
      for (const input of [this.changedOnly, this.filter]) input.addEventListener("input", () => this.#sift());
    }

    #table(group, onToggle) {
      const body = html("tbody");
      for (const [variable, { name, group: of }] of this.#run.variables.entries()) {
        if (of !== group) continue;
        const button = html("button", { type: "button", className: "tl-pin", title: "Show its values on the chart", "aria-pressed": "false" }, name);
        button.addEventListener("click", () => button.setAttribute("aria-pressed", onToggle(variable)));
        const row = html("tr", {}, html("th", { scope: "row" }, button), html("td", { className: "tl-value" }), html("td", { className: "tl-old" }));
        this.#rows[variable] = row;
        body.append(row);
      }
      if (!body.rows.length) return null;
      const table = html("table", {}, html("caption", {}, GROUP_NAMES[group]), body);
      this.#tables.push(table);
      return table;
    }

    select(index) {
      this.#index = index;
      const record = this.#run.records[index];
      const state = stateAfter(this.#run, index);
      const before = index ? stateAfter(this.#run, index - 1) : null;
      const changed = new Set(state ? record.changes.map(({ variable }) => variable) : []);
      for (const [variable, row] of this.#rows.entries()) {
        const [, value, old] = row.cells;
        value.textContent = state ? state[variable] : "";
        row.classList.toggle("changed", changed.has(variable));
        const was = before ? before[variable] : this.#run.nominal[variable];
        old.textContent = changed.has(variable) ? `● ${before ? "was" : "nominally"} ${was}` : "";
      }
      this.note.textContent = state ? "" : "No run has begun yet, so there is no state.";
      this.#sift();
    }

    #sift() {
      const words = this.filter.value.trim().toLowerCase();
      for (const [variable, row] of this.#rows.entries()) {
        const named = this.#run.variables[variable].name.toLowerCase().includes(words);
        row.hidden = !named || (this.changedOnly.checked && !row.classList.contains("changed"));
      }
      for (const table of this.#tables) table.hidden = [...table.tBodies[0].rows].every((row) => row.hidden);
      const state = stateAfter(this.#run, this.#index);
      if (!state) return;
      const none = words ? "No such variable." : "This record changes no variable.";
      this.note.textContent = this.#tables.every((table) => table.hidden) ? none : "";
    }
  }

  // The whole timeline.

  const MOST_CHANGES = 12; // announced with the record; the table and the state have all

  const KEYS = [
    ["←  →", "or k  j", "one record back or on"],
    ["[  ]", "", "to the moment before, to the next one"],
    ["+  −  0", "or Ctrl and wheel", "zoom in, out, show all"],
    ["Shift ←  →", "or drag", "move the part that is shown"],
    ["Home  End", "", "first and last record, if the chart or the table has the focus"],
  ];

  function keysHelp() {
    const items = KEYS.map(([keys, or, what]) => html("li", {}, html("kbd", {}, keys), ` ${or} `, `: ${what}`));
    return html("details", { className: "tl-keys" }, html("summary", {}, "Keys"), html("ul", {}, ...items));
  }

  /** Shows a run in an empty element. */
  function showTimeline(element, run, { record = 0, label = "", onSelect = () => {} } = {}) {
    let selected = -1;
    const last = run.records.length - 1;

    const chart = new Chart(run, choose);
    const table = new RecordTable(run, choose);
    const state = new StatePanel(run, (variable) => chart.toggle(variable));
    const button = (words, title, act, keys) => {
      const made = html("button", { type: "button", title: keys ? `${title} (${keys})` : title, "aria-label": title }, words);
      made.addEventListener("click", act);
      return made;
    };
    const count = html("span", { className: "tl-count" });
    const moment = html("span", { className: "tl-moment" });
    const sentence = html("span", { className: "tl-sentence" });
    const more = html("span", { className: "tl-more" });
    const now = html("div", { className: "tl-now", "aria-live": "polite", "aria-atomic": "true" }, count, moment, sentence, more);
    const steps = html(
      "span",
      { className: "tl-buttons" },
      button("|◀", "first record", () => choose(0)),
      button("◀", "record before", () => choose(selected - 1), "←"),
      button("▶", "next record", () => choose(selected + 1), "→"),
      button("▶|", "last record", () => choose(last)),
    );
    const zoom = html(
      "span",
      { className: "tl-buttons" },
      button("−", "zoom out", () => chart.zoom(1 / 1.5), "-"),
      button("+", "zoom in", () => chart.zoom(1.5), "+"),
      button("all", "show all of the run", () => chart.fit(), "0"),
    );
    const scale = html("select", { "aria-label": "What the axis shows" });
    scale.append(new Option("over time", "time"), new Option("record by record", "records"));
    scale.disabled = !chart.canBeByTime;
    scale.value = chart.byTime ? "time" : "records";
    scale.addEventListener("change", () => chart.measure(scale.value === "time"));
    const bar = html("div", { className: "tl-bar-of-buttons", role: "toolbar", "aria-label": "Timeline" }, steps, zoom, scale, keysHelp());
    const panes = html("div", { className: "tl-panes" }, table.box, state.box);
    const notes = html("ul", { className: "tl-notes" }, ...run.notes.map((words) => html("li", {}, words)));
    const called = { className: "tl", role: "group", "aria-label": `Timeline ${label}`.trim() };
    const root = html("div", called, bar, now, chart.box, chart.map, chart.legend, panes);
    if (run.notes.length) root.append(notes);
    element.append(root);

    function choose(index) {
      const chosen = Math.min(Math.max(index, 0), last);
      if (chosen === selected || chosen < 0) return;
      const isFirst = selected < 0;
      selected = chosen;
      show();
      if (!isFirst) onSelect(chosen);
    }

    function show() {
      const here = run.records[selected];
      count.textContent = `${selected + 1} of ${last + 1}`;
      Object.assign(now.dataset, { kind: here.kind, subject: here.subject, at: here.at });
      moment.textContent = exactly(here.at);
      const broken = run.violations.filter((violation) => violation.record === selected);
      sentence.textContent = here.sentence;
      sentence.className = `tl-sentence ${lookOf(here)}`;
      const before = selected ? stateAfter(run, selected - 1) : null;
      const changes = changesOf(run, here, before).slice(0, MOST_CHANGES);
      if (here.changes.length > MOST_CHANGES) changes.push(`and ${here.changes.length - MOST_CHANGES} more`);
      more.replaceChildren(...broken.map((v) => html("strong", { className: "tl-broken", "data-requirement": v.requirement }, `✗ ${v.requirement}: ${v.reason}`)), ...changes);
      chart.select(selected);
      table.select(selected);
      state.select(selected);
    }

    /** Selects the first record of the previous or the next moment. */
    function moveMoment(direction) {
      const { at } = run.records[selected];
      const others = direction > 0 ? run.records.slice(selected + 1) : run.records.slice(0, selected).reverse();
      const other = others.find((r) => r.at !== at);
      const found = other ?? run.records.at(direction > 0 ? -1 : 0);
      choose(run.records.findIndex((r) => r.at === found.at && (direction < 0 || r.index > selected)));
      if (!other) choose(found.index);
    }

    function onKey(event) {
      if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || last < 0) return;
      if (event.target.closest?.("input:not([type=checkbox]), textarea, select, dialog")) return;
      const act = actOf(event);
      if (!act) return;
      event.preventDefault();
      act();
    }

    function actOf({ key, shiftKey, target }) {
      if (shiftKey && key === "ArrowLeft") return () => chart.pan(-0.2);
      if (shiftKey && key === "ArrowRight") return () => chart.pan(0.2);
      const inTable = target === table.box;
      if (inTable || target === chart.box) {
        if (key === "Home") return () => choose(0);
        if (key === "End") return () => choose(last);
      }
      if (inTable && key === "ArrowUp") return () => choose(selected - 1);
      if (inTable && key === "ArrowDown") return () => choose(selected + 1);
      return {
        ArrowLeft: () => choose(selected - 1),
        ArrowRight: () => choose(selected + 1),
        k: () => choose(selected - 1),
        j: () => choose(selected + 1),
        "[": () => moveMoment(-1),
        "]": () => moveMoment(1),
        "+": () => chart.zoom(1.5),
        "=": () => chart.zoom(1.5),
        "-": () => chart.zoom(1 / 1.5),
        0: () => chart.fit(),
      }[key];
    }

    const whole = () => {
      table.fillAll();
      chart.draw();
    };
    document.addEventListener("keydown", onKey);
    addEventListener("beforeprint", whole);
    if (last >= 0) choose(record);
    else now.textContent = "Nothing happened.";
    chart.draw();

    return {
      select: choose,
      /** Returns the edges of the lane that shows the selected record, in the window. */
      laneOfSelected: () => chart.laneOfSelected(),
      destroy() {
        document.removeEventListener("keydown", onKey);
        removeEventListener("beforeprint", whole);
        chart.destroy();
        table.destroy();
        root.remove();
      },
    };
  }

  return { Timelines, showTimeline };
})();
