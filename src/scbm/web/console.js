// The page of `scbm console`. It keeps the text of the case, the texts before, and the selected record; the server runs
// texts. `Timelines` and `showTimeline` are those of the HTML report (timeline.js).
/* global Timelines, showTimeline */

const byId = (id) => document.getElementById(id);
const say = (words) => { byId("said").textContent = words; };
const MOST_PAST = 200;
const POLL_MS = 1000;
const TYPING_MS = 400;
const ABOUT_REQUESTS = ["request_sent", "request_cancelled", "reply_received", "reply_dropped", "message"];

/** Returns an element with properties or attributes, and children. */
function h(tag, properties, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties ?? {})) {
    if (name in element) element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

// ---- what a reload keeps

const kept = { text: "", record: 0, past: [], future: [], saved: {}, seen: [] };
const token = location.hash.slice(1);
const page = `${Math.random()}`; // pages of one console do not end each other's runs and searches

function keep() {
  try {
    sessionStorage.setItem(`scbm-console-${token}`, JSON.stringify(kept));
  } catch {
    // no memory: a reload begins anew
  }
}

// ---- the server

let facts = null;
let beginning = null;
let digest = null;
let newest = 0; // the number of the last request for a run: older answers are not shown

async function post(name, body = {}) {
  let response;
  try {
    response = await fetch(`/${name}`, { method: "POST", headers: { "X-Scbm-Token": token }, body: JSON.stringify({ page, ...body }), keepalive: name === "search_end" });
  } catch {
    note("gone", "The server has ended. Start `scbm console` again, and copy the text of the case into its page.");
    throw new Error("no server");
  }
  note("gone", "");
  return response.json();
}

const notes = {};

/** Shows a sentence above the page until it is replaced by an empty one. */
function note(about, words) {
  if ((notes[about] ?? "") === words) return;
  notes[about] = words;
  byId("notice").textContent = Object.values(notes).filter(Boolean).join("\n");
}

// ---- texts and runs

let shown = null; // the run that is shown: {run, data, timeline}

async function ask(name, body, isNewText) {
  const number = (newest += 1);
  const answer = await post(name, body);
  if (number !== newest) return;
  if (answer.text !== undefined && answer.text !== kept.text) {
    if (isNewText) remember();
    setText(answer.text);
  }
  await showAnswer(answer);
  keep();
}

function remember() {
  kept.past.push(kept.text);
  kept.past.splice(0, kept.past.length - MOST_PAST);
  kept.future = [];
}

function setText(text) {
  kept.text = text;
  if (byId("text").value !== text) byId("text").value = text;
  byId("undo").disabled = kept.past.length === 0;
  byId("redo").disabled = kept.future.length === 0;
}

const run = () => ask("run", { text: kept.text });

function move(from, to) {
  if (!from.length) return;
  to.push(kept.text);
  setText(from.pop());
  run();
}

async function showAnswer(answer) {
  const errors = answer.errors ?? [];
  const model = (answer.model_errors ?? []).map((each) => `${[each.file, each.line || []].flat().join(":")}: ${each.message}${each.remedy && `; ${each.remedy}`}`);
  note("refused", answer.refused ?? "");
  note("model", model.length ? `The model has errors; this is its last good run.\n${model.join("\n")}` : "");
  note("ended", answer.ended ? `This run was stopped: ${answer.ended}. The run before is shown.` : answer.run?.limit ?? "");
  byId("errors").replaceChildren(...errors.map(errorLine));
  byId("text").setAttribute("aria-invalid", String(errors.length > 0));
  byId("middle").classList.toggle("stale", !answer.run && !answer.refused);
  if (answer.run) await showRun(answer.run);
  say(answer.refused ?? (errors.length ? `line ${errors[0].line}: ${errors[0].message}` : model[0] ?? answer.ended ?? byId("verdict").textContent));
}

function errorLine(error) {
  const words = `line ${error.line}: ${error.message}${error.remedy ? `; ${error.remedy}` : ""}`;
  return h("li", {}, h("button", { type: "button", onclick: () => toLine(error.line) }, words));
}

function toLine(line) {
  const lines = kept.text.split("\n");
  const begin = lines.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
  byId("text").focus();
  byId("text").setSelectionRange(begin, begin + (lines[line - 1] ?? "").length);
}

async function showRun(answer) {
  const data = await new Timelines(answer.timeline).load(0);
  const focused = document.activeElement?.closest?.(".tl-chart, .tl-records")?.className.split(" ")[0];
  shown?.timeline.destroy();
  byId("state").replaceChildren();
  kept.record = Math.min(kept.record, data.records.length - 1);
  shown = { run: answer, data, timeline: null };
  shown.timeline = showTimeline(byId("middle"), data, { record: kept.record, onSelect: select });
  byId("state").append(document.querySelector("#middle .tl-state"));
  if (focused) document.querySelector(`#middle .${focused}`).focus({ preventScroll: true });
  kept.seen = [...new Set([...kept.seen, ...answer.visited])];
  showVerdict(answer, data);
  fill("request", data.records.filter(({ kind }) => kind === "request_sent").map(requestOption));
  showCells();
  select(kept.record);
}

const requestOption = ({ number, subject, detail }) => [String(number), `${number} → ${subject}${detail && `: ${detail}`}`];

function showVerdict({ end, passed }, { failures, ended }) {
  const why = failures.map(({ message }) => message).join("; ");
  byId("verdict").textContent = `${passed ? "✓ passed" : "✗ failed"}: ${end} after ${(ended / 1e9).toFixed(3)} s${why && `; ${why}`}`;
  byId("verdict").className = passed ? "good" : "bad";
}

// ---- the selected moment

let wanted = 0; // the number of the last request about a moment

async function select(record) {
  kept.record = record;
  keep();
  const { at, kind, number, index } = shown.data.records[record];
  byId("here").textContent = `at ${(at / 1e9).toFixed(3)} s`;
  const sent = shown.data.records.filter((each) => each.kind === "request_sent");
  const request = ABOUT_REQUESTS.includes(kind) ? number : (sent.findLast((each) => each.index <= index) ?? sent[0])?.number;
  if (request) byId("target-request").value = String(request);
  showRequirements();
  showPictures();
  const asked = (wanted += 1);
  const moment = await post("moment", { text: kept.text, record, target: byId("operation").value });
  if (asked !== wanted || !moment.guards) return;
  byId("guards").replaceChildren(...moment.guards.flatMap(guardParts));
  fill("change", moment.offers.map(({ target, label }) => [target, label]));
  offered = new Set(moment.offers.map(({ target }) => target.split(":")[1] || target));
  showHint();
}

let offered = new Set();

function guardParts({ role, operation, part, clauses }) {
  const open = clauses.filter(([, holds]) => !holds).length;
  const head = { current: "Current", next: "Next", chosen: "Chosen" }[role];
  const waits = open ? `${open} of ${clauses.length} ${open === 1 ? "does" : "do"} not hold` : "all hold";
  const title = h("h3", {}, `${head}: ${operation}, to ${part}: ${waits}`);
  const items = clauses.map(([text, holds, values]) => h("li", { className: holds ? "good" : "bad" },
    h("span", {}, holds ? "✓" : "✗"), h("span", {}, text, ...(holds ? [] : [h("small", {}, values)]))));
  return [title, h("ul", {}, ...items)];
}

function showRequirements() {
  const { run: { requirements }, data: { violations } } = shown;
  const names = [...new Set([...requirements, ...violations.map(({ requirement }) => requirement)])];
  byId("requirements").replaceChildren(...names.map((name) => {
    const broken = violations.find(({ requirement }) => requirement === name);
    const isBroken = broken && broken.record <= kept.record;
    const later = broken && !isBroken ? "; broken later" : "";
    const words = h("span", {}, isBroken ? `${name}: ${broken.reason}` : name + later);
    const shownWords = broken ? h("button", { type: "button", onclick: () => shown.timeline.select(broken.record) }, words) : words;
    return h("li", { className: isBroken ? "bad" : "good" }, h("span", {}, isBroken ? "✗" : "✓"), shownWords);
  }));
}

// ---- coverage, and Show me

function showCells() {
  const [inRun, seen, stored] = [shown.run.visited, kept.seen, beginning.stored].map((names) => new Set(names));
  const of = (name) => (inRun.has(name) ? "run" : seen.has(name) ? "seen" : stored.has(name) ? "store" : "");
  byId("cells").replaceChildren(...facts.obligations.map((name) => h("span", { className: of(name), title: name })));
  const fresh = facts.obligations.filter((name) => seen.has(name) && !stored.has(name)).length;
  const count = (names) => facts.obligations.filter((name) => names.has(name)).length;
  const more = beginning.has_store ? `, ${fresh} of them new to the store` : "";
  byId("counts").textContent = `This run visits ${count(inRun)} of ${facts.obligations.length} obligations, this session ${count(seen)}${more}.`;
  const missing = facts.obligations.filter((name) => !seen.has(name) && !stored.has(name));
  options(byId("obligation"), missing.map((name) => [name, name]));
}

async function search(event) {
  event.preventDefault();
  let answer = await post("search", { obligation: byId("obligation").value });
  byId("cancel").hidden = false;
  while (answer.state === "running") {
    const words = `Looking for ${answer.obligation} … ${answer.progress}`;
    if (byId("found").textContent !== words) byId("found").textContent = words;
    await new Promise((resolve) => { setTimeout(resolve, POLL_MS / 4); });
    answer = await post("search_state");
  }
  byId("cancel").hidden = true;
  const verdict = { covered: "here it is", excluded: "proved: no run visits it", uncoverable: "proved: no run visits it", undecided: "not found within the limits" };
  const words = answer.state === "none" ? "Cancelled." : `${answer.obligation}: ${verdict[answer.decision] ?? "not found"}; ${answer.reason}`;
  byId("found").textContent = words;
  if (answer.text) {
    remember();
    kept.record = answer.record;
    setText(answer.text);
    await run();
  }
  say(words);
}

// ---- automata

function showPictures() {
  for (const details of byId("automata").children) if (details.open) showPicture(details);
}

async function showPicture(details) {
  const { variable } = details.dataset;
  const row = [...byId("state").querySelectorAll("tr")].find((each) => each.cells[0]?.textContent === variable);
  const value = row?.cells[1].textContent ?? "";
  if (details.dataset.value === value) return;
  details.dataset.value = value;
  const { svg, errors } = await post("picture", { target: variable, name: value });
  if (details.dataset.value !== value) return;
  const picture = svg && h("img", { src: `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`, alt: `${variable} = ${value}` });
  const why = errors ? `${errors[0].message}; ${errors[0].remedy}` : "Nothing changes it.";
  details.replaceChildren(details.firstElementChild, picture || h("p", { className: "hint" }, why));
}

// ---- what if: buttons and fields from the list of edits

const TITLES = { request: "A request", variable: "A variable", resource: "A resource", change: "What may happen here", initial: "The initial state", goal: "The goal" };

function makeEdits() {
  const targets = [...new Set(facts.edits.map(({ target }) => target))];
  byId("edits").replaceChildren(...targets.map((target) => {
    const select = h("select", { id: `target-${target}`, "aria-label": TITLES[target], onchange: () => chooseTarget(target) });
    const made = new Map();
    const field = ({ name, label, value, choices }) => {
      if (made.has(name)) return [];
      const plain = name === "value" || choices.length ? h("select", { "aria-label": label }) : h("input", { "aria-label": label, value });
      if (choices.length) options(plain, choices.map((each) => [each, each]), value);
      if (name === "value") plain.id = `value-${target}`;
      made.set(name, plain);
      return [plain];
    };
    const edits = facts.edits.filter((edit) => edit.target === target);
    const values = edits.flatMap(({ fields }) => fields.filter(({ name }) => name === "value")).flatMap(field);
    const pairs = edits.map((edit) => h("span", { className: "pair" },
      h("button", { type: "button", "data-edit": edit.name, onclick: () => click(edit, select, made) }, edit.label),
      ...edit.fields.flatMap(field)));
    const hint = target === "variable" ? [h("p", { id: "hint", className: "hint" })] : [];
    return h("fieldset", {}, h("legend", {}, TITLES[target]), h("label", {}, select), ...values, ...pairs, ...hint);
  }));
  const named = (names) => names.map((name) => [name, name]);
  fill("variable", named(facts.variables.map(({ name }) => name)));
  fill("initial", named(facts.variables.filter(({ is_initial }) => is_initial).map(({ name }) => name)));
  fill("resource", named(facts.resources));
  fill("goal", named(facts.goals));
  byId("value-variable").addEventListener("change", showHint);
}

function click(edit, select, made) {
  const values = Object.fromEntries(edit.fields.map(({ name }) => [name, made.get(name).value]));
  ask("edit", { text: kept.text, record: kept.record, edit: edit.name, target: select.value, values }, true);
}

/** Replaces the options of a select, and keeps its value where that is possible. */
function options(select, pairs, value = select.value) {
  const same = select.options.length === pairs.length && pairs.every(([each], i) => select.options[i].value === each);
  if (!same) select.replaceChildren(...pairs.map(([each, words]) => new Option(words, each)));
  if (pairs.some(([each]) => each === value)) select.value = value;
}

function fill(target, pairs) {
  const select = byId(`target-${target}`);
  options(select, pairs);
  const fieldset = select.closest("fieldset");
  const isFocused = fieldset.contains(document.activeElement);
  fieldset.hidden = pairs.length === 0;
  if (isFocused && fieldset.hidden) byId("edits").querySelector("fieldset:not([hidden]) select").focus();
  chooseTarget(target);
}

function chooseTarget(target) {
  const values = byId(`value-${target}`);
  if (!values) return;
  const variable = facts.variables.find(({ name }) => name === byId(`target-${target}`).value);
  options(values, (variable?.values ?? []).map((each) => [each, each]));
  if (target === "variable") showHint();
}

function showHint() {
  const change = `${byId("target-variable").value}=${byId("value-variable").value}`;
  byId("hint").textContent = offered.has(change) ? "This can happen here from outside." : "This forces the state from here.";
}

// ---- the whole page

async function save(event) {
  event.preventDefault();
  const name = byId("name").value.trim();
  const body = { text: kept.text, name, records: byId("records").checked, known: kept.saved[name] ?? "" };
  const answer = await post("save", body);
  if (answer.path) {
    kept.saved[name] = answer.known;
    if (answer.text !== kept.text) remember();
    setText(answer.text);
    await run();
    say(`Saved as ${answer.path}${body.records && !answer.recorded ? "; without a result, as the case fails" : ""}`);
    note("refused", "");
    byId("saved").textContent = byId("said").textContent;
    return;
  }
  byId("saved").textContent = "";
  await showAnswer(answer);
}

async function load() {
  const answer = await post("facts");
  if (answer.model_errors) return answer;
  facts = answer;
  byId("model").textContent = facts.model;
  document.title = `${facts.model} · scbm console`;
  makeEdits();
  options(byId("operation"), [["", "no other operation"], ...facts.operations.map((name) => [name, name])]);
  const drawn = facts.variables.filter(({ is_initial }) => is_initial);
  byId("automata").replaceChildren(...drawn.map(({ name }, place) => h("details", { "data-variable": name, open: place < 2,
    ontoggle: ({ target }) => { if (target.open && shown) showPicture(target); } }, h("summary", {}, name))));
  return null;
}

async function poll() {
  try {
    const found = (await post("digest")).digest;
    if (found !== digest) {
      digest = found;
      const errors = await load();
      if (errors) await showAnswer(errors);
      else await run();
    }
  } catch {
    // the notice says that the server has ended
  }
  setTimeout(poll, POLL_MS);
}

const KEYS = {
  u: () => move(kept.past, kept.future),
  U: () => move(kept.future, kept.past),
  e: () => byId("text").focus(),
  r: () => byId("target-request").focus(),
  v: () => byId("target-variable").focus(),
  g: () => byId("operation").focus(),
  m: () => byId("obligation").focus(),
  s: () => byId("name").focus(),
  "?": () => byId("help").showModal(),
};

function onKey(event) {
  if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
  const isField = event.target.closest?.("input:not([type=checkbox]), textarea, select, dialog[open]");
  if (event.key === "Escape" && isField && !event.target.closest("dialog")) event.target.blur();
  const act = isField ? null : KEYS[event.key];
  if (!act) return;
  event.preventDefault();
  act();
}

let typing = 0;

function onType() {
  clearTimeout(typing);
  typing = setTimeout(() => {
    if (byId("text").value === kept.text) return;
    remember();
    setText(byId("text").value);
    run();
  }, TYPING_MS);
}

async function begin() {
  beginning = await post("begin");
  if (beginning.refused) return note("refused", beginning.refused);
  ({ digest } = await post("digest"));
  const before = JSON.parse(sessionStorage.getItem(`scbm-console-${token}`) ?? "null");
  Object.assign(kept, before ?? { text: beginning.text });
  byId("name").value = /^case:\s*([\w.-]+)/m.exec(kept.text)?.[1] ?? "my_case";
  const errors = await load();
  if (errors) return showAnswer(errors);
  setText(kept.text);
  await run();
  byId("text").addEventListener("input", onType);
  byId("undo").addEventListener("click", KEYS.u);
  byId("redo").addEventListener("click", KEYS.U);
  byId("keys").addEventListener("click", KEYS["?"]);
  byId("save").addEventListener("submit", save);
  byId("search").addEventListener("submit", search);
  byId("cancel").addEventListener("click", () => post("search_end"));
  addEventListener("pagehide", () => post("search_end"));
  byId("operation").addEventListener("change", () => select(kept.record));
  byId("cells").addEventListener("click", ({ target }) => { if (target.title) byId("obligation").value = target.title; });
  byId("state").addEventListener("click", ({ target }) => {
    const row = target.closest("tr");
    if (!row || target.closest("button")) return;
    byId("target-variable").value = row.cells[0].textContent;
    chooseTarget("variable");
    byId("value-variable").focus();
  });
  addEventListener("keydown", onKey);
  setTimeout(poll, POLL_MS);
  document.documentElement.dataset.ready = "true";
  return undefined;
}

begin();
