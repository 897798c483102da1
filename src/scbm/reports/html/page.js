// The script of the report. The first page needs no data, so each block of data is parsed when it is first used.
"use strict";
(() => {
  const PER_PAGE = 200;
  const FEW_LINES = 3; // fewer lines without obligations are not folded
  const MOST_FOUND = 8; // of each kind, in the search of the header
  const root = document.documentElement;
  const byId = (id) => document.getElementById(id);

  // ---- elements

  /** Returns an element with attributes (event handlers as functions) and children; null is left out. */
  function h(tag, attributes, ...children) {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes ?? {})) {
      if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
      else if (value === true) element.setAttribute(name, "");
      else if (value !== null && value !== undefined && value !== false) element.setAttribute(name, value);
    }
    element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== ""));
    return element;
  }

  const number = (value, title) => h("td", { class: "number", title }, String(value));
  const seconds = (ns) => `${(ns / 1e9).toFixed(3)} s`;
  const counted = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;
  const say = (words) => { byId("said").textContent = words; };
  const nameOf = ([subject, aspect]) => (aspect === "taken" ? `automatic/${subject}` : `${subject}/${aspect}`);
  const casesThatVisit = (name) => `#/cases?visits=${encodeURIComponent(name)}`;
  const caseAddress = (label, record = null, form = "") => `#/case/${encodeURIComponent(label)}${form && `/${form}`}${record === null ? "" : `/step/${record + 1}`}`;

  function verdict(failed) {
    return h("span", { class: `verdict ${failed ? "failed" : "visited"}`, "data-verdict": failed ? "failed" : "passed" }, failed ? "✗ failed" : "✓ passed");
  }

  const copyButton = () => h("button", { type: "button", class: "copy", "aria-label": "Copy the command" }, "Copy");
  const command = (text) => h("span", { class: "command" }, h("code", null, text), copyButton());

  // ---- data

  /** Returns a function that calls `make` once and then returns the cached result. */
  function once(make) {
    let made;
    return () => (made ??= { value: make() }).value;
  }

  const read = (id) => JSON.parse(byId(id).textContent);
  const columns = once(() => read("columns"));
  const details = once(() => read("details"));
  const timelines = once(() => new Timelines(read("timelines")));
  const indexOf = once(() => new Map([...columns().label.entries()].reverse().map(([index, label]) => [label, index])));
  const bitOf = once(() => new Map(columns().obligations.map((obligation, bit) => [nameOf(obligation), bit])));
  const searched = once(() => {
    const c = columns();
    return c.label.map((label, i) => `${label}\n${c.goals[c.goal[i]]}\n${c.ends[c.end[i]]}\n${c.places[c.place[i]].join("\n")}`.toLowerCase());
  });
  const templates = once(() => new Map([...document.querySelectorAll("template")].map((template) => [template.content.firstElementChild.id, template])));
  const sourceLines = once(() => [...pageOf("/source").querySelectorAll(".line")].map((line) => (
    { line, text: line.querySelector("code").textContent, number: line.querySelector(".no").textContent }
  )));

  const visits = (set, bit) => (parseInt(set[bit >> 2] ?? "0", 16) >> (bit & 3)) & 1;
  const placeOf = (index) => columns().places[columns().place[index]][1]; // the nodes that it ran over; empty in simulation
  const isOverNodes = once(() => columns().places.some(([, place]) => place)); // whether any case was
  const failuresOf = (index) => columns().failures[index] ?? [];

  // ---- which page

  function parse(hash) {
    const [path, query] = hash.replace(/^#\/?/, "").split(/\?(.*)/s);
    const [page, rest] = path.split(/\/(.*)/s);
    const [, name, form, step] = (page === "case" && /^([^/]*)(?:\/(smallest|found))?(?:\/step\/(\d+))?$/.exec(rest ?? "")) || [null, rest ?? ""];
    return { address: hash, page: page || "missing", name: decoded(name), form: form ?? null, step: step ? Number(step) : null, query: new URLSearchParams(query ?? "") };
  }

  function decoded(text) {
    try {
      return decodeURIComponent(text);
    } catch {
      return text; // a % that is no escape
    }
  }

  /** Returns the page with an identifier, also one that still stands in its template; null if there is none. */
  const pageOf = (id) => byId(id) ?? templates().get(id)?.content.firstElementChild ?? null;

  /** Moves a page from its template into the document. */
  function place(section) {
    if (!section.isConnected) byId("main").append(section);
    for (const source of section.querySelectorAll(".source:empty")) fillSource(source);
    addCopyButtons(section);
  }

  /** Moves the page of an operation back into its template: hundreds of them would be too much for the document. */
  function putBack(section) {
    if (section.matches(".operation")) templates().get(section.id).content.append(section);
  }

  /** Copies the lines of an operation, and what their marks mean, from the page of the source. */
  function fillSource(source) {
    const { first, last } = source.dataset;
    const lines = sourceLines().slice(first - 1, last).map(({ line }) => line.cloneNode(true));
    for (const line of lines) {
      line.removeAttribute("id");
      line.hidden = false;
      line.classList.remove("open", "target");
    }
    source.append(...lines);
    source.before(pageOf("/source").querySelector(".of-lines").cloneNode(true));
  }

  function addCopyButtons(part) {
    for (const found of part.querySelectorAll(".command:not(:has(.copy))")) found.append(copyButton());
  }

  function sectionOf(route) {
    const named = ["operation", "case", "source"].includes(route.page) && route.name;
    const section = pageOf(route.page === "operation" ? `/operation/${route.name}` : `/${route.page}`);
    if (!section?.classList.contains("page") || (route.name && !named)) return byId("/nothing");
    return route.page === "case" && !indexOf().has(route.name) ? byId("/nothing") : section;
  }

  let shown = null; // the route
  let selectStep = null; // selects a step of the case that is shown; returns whether its timeline is open and has the step
  let leave = null; // the callback for leaving the page
  let isFollowed = false; // whether a link led here, rather than the history of the browser
  const positions = new Map(); // the scroll position of each address, for the way back

  function show() {
    const route = parse(location.hash);
    const section = sectionOf(route);
    if (section.id === "/case" && shown?.page === "case" && shown.name === route.name && shown.form === route.form && selectStep?.(route.step)) {
      shown = route;
      return;
    }
    leave?.();
    leave = null;
    const isFirst = shown === null;
    shown = route;
    for (const page of document.querySelectorAll(".page.shown")) {
      page.classList.remove("shown");
      if (page !== section) putBack(page);
    }
    place(section);
    section.classList.add("shown");
    closeResults();
    markNavigation(route.page);
    if (section.id === "/cases") showCases(section.querySelector(".content"), route.query);
    if (section.id === "/case") leave = showCase(section.querySelector(".content"), indexOf().get(route.name));
    const title = section.dataset.title && section.id !== "/case" ? section.dataset.title : route.name;
    document.title = `${title} · ${document.querySelector(".name").textContent}`;
    if (section.id === "/source") colourSource();
    if (section.id === "/source" && route.name) showLine(route.name);
    else if (section.id === "/source" && isFirst) addEventListener("load", () => requestAnimationFrame(() => showHole(firstHole())), { once: true }); // the browser scrolls to the fragment first
    else if (section.id === "/source" && isFollowed) showHole(firstHole());
    else if (!isFirst) begin(section);
    isFollowed = false;
  }

  /** Scrolls to the top of a page and focuses its heading; on the way back, to where the page was left. */
  function begin(section) {
    if (!section.contains(document.activeElement)) section.querySelector("h1")?.focus({ preventScroll: true });
    scrollTo(0, isFollowed ? 0 : (positions.get(location.hash) ?? 0));
  }

  function markNavigation(page) {
    const current = { operation: "operations", case: "cases" }[page] ?? page;
    for (const link of document.querySelectorAll("nav a")) {
      if (link.hash === `#/${current}`) link.setAttribute("aria-current", "page");
      else link.removeAttribute("aria-current");
    }
  }

  function showLine(name) {
    const line = markLine(name);
    if (!line) return;
    if (line.hidden) unfold(line);
    line.scrollIntoView({ block: "center" });
  }

  function markLine(name) {
    const line = byId(`/source/${name}`);
    for (const other of document.querySelectorAll(".line.target")) other.classList.remove("target");
    line?.classList.add("target");
    return line;
  }

  function go(address) {
    follow(address);
    location.hash = address;
  }

  /** Stores the scroll position of the page, as a scroll event may come too late. */
  function follow(address) {
    if (address === location.hash) return;
    positions.set(shown.address, scrollY);
    isFollowed = true;
  }

  /** Replaces the address of the page without a new entry in the history of the browser. */
  const rename = (address) => { history.replaceState(null, "", address); shown = parse(address); };

  // ---- the list of cases

  const SORTS = {
    number: (c, i) => i,
    case: (c, i) => c.label[i],
    verdict: (c, i) => (c.failures[i] ? 0 : 1),
    goal: (c, i) => c.goals[c.goal[i]],
    end: (c, i) => c.ends[c.end[i]],
    place: (c, i) => c.places[c.place[i]][0],
    simulated: (c, i) => c.ended_ns[i],
    requests: (c, i) => c.requests[i],
    visits: (c, i) => c.visits[i],
    only: (c, i) => c.only[i],
  };
  const headsOfCases = () => [
    ["number", "No.", "number", "In the order in which they were run"], ["case", "Case"], ["verdict", "Verdict"],
    ["goal", "Goal"], ["end", "Ended"],
    ...(isOverNodes() ? [["place", "Ran"], ["simulated", "Time", "number", "In time of its run"]] : [["simulated", "Simulated", "number"]]),
    ["requests", "Requests", "number"],
    ["visits", "Visits", "number", "How many obligations of the figure it visits"],
    ["only", "Only it", "number", "How many obligations no other case visits"],
  ];
  const collator = new Intl.Collator("en", { numeric: true });
  let lastList = "#/cases";
  let order = null; // the indices of the cases listed last, for the buttons to the previous and the next case

  /** Returns the cases that match a query, in its order. */
  function chosen(query) {
    const c = columns();
    const words = (query.get("q") ?? "").toLowerCase().split(/\s+/).filter(Boolean);
    const names = query.getAll("visits");
    const bits = names.map((name) => bitOf().get(name));
    const failed = query.get("failed");
    const nodes = query.has("nodes");
    const texts = words.length ? searched() : null;
    const hasSet = c.sets.map((set) => bits.every((bit) => bit !== undefined && visits(set, bit)));
    const found = [];
    for (let i = 0; i < c.label.length; i++) {
      if (!hasSet[c.set[i]] || (nodes && !placeOf(i))) continue;
      if (failed !== null && !failuresOf(i).some(([, , , cause]) => !failed || failed === String(cause))) continue;
      if (words.every((word) => texts[i].includes(word))) found.push(i);
    }
    return sorted(found, query.get("sort") ?? "number");
  }

  /** Returns the subject of a cause by the number in the address. */
  function causeOf(number) {
    const failures = Object.values(columns().failures).flat();
    const found = failures.find(([, , , cause]) => number === String(cause));
    return found ? `${found[0].replaceAll("_", " ")} ${found[1]}` : "nothing";
  }

  function sorted(found, sort) {
    const sign = sort.startsWith("-") ? -1 : 1;
    const key = SORTS[sort.replace(/^-/, "")] ?? SORTS.number;
    const c = columns();
    if (key === SORTS.number) return sign > 0 ? found : found.reverse();
    const keys = new Map(found.map((i) => [i, key(c, i)]));
    const compare = typeof keys.get(found[0]) === "string" ? collator.compare : (a, b) => a - b;
    return found.sort((a, b) => sign * compare(keys.get(a), keys.get(b)) || a - b);
  }

  function addressOf(query, changes) {
    const next = new URLSearchParams(query);
    for (const [name, value] of Object.entries(changes)) {
      if (value === null || value === "") next.delete(name);
      else next.set(name, value);
    }
    const text = next.toString().replace(/\+/g, "%20").replace(/(?<=^|&)(failed|nodes)=(?=&|$)/g, "$1");
    return `#/cases${text ? `?${text}` : ""}`;
  }

  function showCases(content, query) {
    const input = content.querySelector("input.of-cases");
    if (!input) content.replaceChildren(...frameOfCases());
    const field = content.querySelector("input.of-cases");
    if (document.activeElement !== field) field.value = query.get("q") ?? "";
    for (const name of ["failed", "nodes"]) {
      const box = content.querySelector(`input.only-${name}`);
      if (box) box.checked = query.has(name);
    }
    content.querySelector(".chips").replaceChildren(...chips(query));
    listCases(content, query);
  }

  function frameOfCases() {
    const typed = (event) => {
      rename(addressOf(shown.query, { q: event.target.value, page: null }));
      listCases(event.target.closest(".content"), shown.query);
    };
    const only = (name, words) => h("label", null, h("input", { type: "checkbox", class: `only-${name}`, onchange: (event) => {
      const next = new URLSearchParams(shown.query);
      if (event.target.checked) next.set(name, "");
      else next.delete(name);
      go(addressOf(next, { page: null }));
    } }), words);
    return [
      h("div", { class: "controls" },
        h("input", { type: "search", class: "of-cases", placeholder: "Filter", "aria-label": "Filter cases by name, goal or end", oninput: typed }),
        only("failed", "failed only"),
        isOverNodes() ? only("nodes", "over nodes only") : "",
        h("span", { class: "chips" })),
      h("div", { class: "pager" }),
      h("div", { class: "scroll" }),
    ];
  }

  /** Returns the active filters of the list, each with a button that removes it. */
  function chips(query) {
    const chip = (words, filter, without) => h("span", { class: "chip", ...filter }, words,
      h("button", { type: "button", "aria-label": `Without: ${words}`, onclick: () => go(without()) }, "×"));
    const named = query.getAll("visits").map((name) => chip(
      bitOf().has(name) ? `visits ${name}` : `visits ${name}, which is no obligation`,
      { "data-visits": name, "data-known": String(bitOf().has(name)) },
      () => {
        const next = new URLSearchParams(query);
        next.delete("visits");
        for (const other of query.getAll("visits")) if (other !== name) next.append("visits", other);
        return addressOf(next, { page: null });
      }));
    const failed = query.get("failed");
    return failed ? [...named, chip(`fails for ${causeOf(failed)}`, { "data-cause": failed }, () => addressOf(query, { failed: null, page: null }))] : named;
  }

  function listCases(content, query) {
    order = chosen(query);
    lastList = shown.address;
    const pages = Math.max(1, Math.ceil(order.length / PER_PAGE));
    const page = Math.min(pages, Math.max(1, parseInt(query.get("page") ?? "1", 10) || 1));
    const first = (page - 1) * PER_PAGE;
    const rows = order.slice(first, first + PER_PAGE);
    content.querySelector(".pager").replaceChildren(...pager(query, page, pages, first, rows.length));
    content.querySelector(".scroll").replaceChildren(rows.length
      ? h("table", { class: "cases" }, headOfCases(query), h("tbody", null, rows.map(rowOfCase)))
      : h("p", { "data-notice": columns().label.length ? "no-match" : "no-case" }, columns().label.length ? "No case matches." : "No case has been run yet."));
  }

  function pager(query, page, pages, first, count) {
    const all = columns().label.length;
    const found = order.length === all ? counted(all, "case") : `${order.length} of ${counted(all, "case")}`;
    const range = pages > 1 ? `, ${first + 1} to ${first + count} shown` : "";
    const words = h("span", {
      role: "status", class: "found", "data-found": order.length, "data-of": all, "data-first": first + 1, "data-last": first + count,
    }, found + range);
    if (pages === 1) return [words];
    const turn = (label, to, name) => h("button", {
      type: "button", class: name, disabled: to < 1 || to > pages, onclick: () => go(addressOf(query, { page: to === 1 ? null : to })),
    }, label);
    return [words, turn("← Previous", page - 1, "previous"), h("span", null, `page ${page} of ${pages}`), turn("Next →", page + 1, "next")];
  }

  function headOfCases(query) {
    const [, sign, name] = /^(-?)(.*)$/.exec(query.get("sort") ?? "number");
    return h("thead", null, h("tr", null, headsOfCases().map(([sort, words, kind, title]) => h("th", {
      scope: "col", class: kind, title, "aria-sort": sort === name ? (sign ? "descending" : "ascending") : null,
    }, h("button", { type: "button", onclick: () => turnOrder(query, sort, sort === name, sign, kind) }, words)))));
  }

  function turnOrder(query, sort, isCurrent, sign, kind) {
    const isFirst = sort === "number" || kind !== "number"; // other numbers are sorted from the largest
    const next = isCurrent ? (sign ? sort : `-${sort}`) : (isFirst ? sort : `-${sort}`);
    rename(addressOf(query, { sort: next === "number" ? null : next, page: null }));
    const content = document.querySelector(".page.shown .content");
    listCases(content, shown.query);
    content.querySelector("th[aria-sort] button")?.focus();
  }

  function rowOfCase(i) {
    const c = columns();
    return h("tr", { "data-case": c.label[i] }, number(i + 1), h("th", { scope: "row" }, h("a", { href: caseAddress(c.label[i]) }, c.label[i])),
      h("td", null, verdict(c.failures[i])), h("td", null, c.goals[c.goal[i]]), h("td", null, c.ends[c.end[i]]),
      isOverNodes() ? h("td", { title: placeOf(i) || null }, c.places[c.place[i]][0]) : "",
      number(seconds(c.ended_ns[i])), number(c.requests[i]), number(c.visits[i]), number(c.only[i] || "–"));
  }

  // ---- one case

  /** Shows a case; returns the callback for leaving it. */
  function showCase(content, index) {
    const c = columns();
    const failures = failuresOf(index);
    const again = details().commands[index];
    const text = details().texts[index];
    const ran = placeOf(index);
    const small = smallestOf(index);
    const isSmall = small !== null && (shown.form === "smallest" || (shown.form === null && shown.step === null));
    const place = h("div", { class: "of-timeline" }, h("p", { class: "about" }, "Opening its timeline …"));
    content.replaceChildren(
      neighbours(index),
      h("h1", { tabindex: "-1" }, c.label[index]),
      h("p", null, verdict(failures.length), ` ${c.ends[c.end[index]]} after ${seconds(c.ended_ns[index])}`),
      ran ? h("p", { class: "ran", "data-place": ran }, `It ran ${ran}.${again ? " That run cannot be repeated: the timeline is that of its log." : ""}`) : "",
      failures.length ? h("ul", { class: "failures" }, failures.map(([, , message]) => h("li", null, message))) : "",
      isSmall ? "" : again ? h("p", { class: "again" }, ran ? "Again, with its whole run: " : "Again: ", command(again))
        : h("p", { class: "notice", "data-notice": c.ends[c.end[index]] === "lost" ? "lost" : "earlier-model" }, c.ends[c.end[index]] === "lost" ? "Its run did not finish, because a node was lost."
          : "It ran on an earlier version of the model, so it cannot be run again."),
      failures.length ? formsOf(index, small, isSmall) : "",
      h("h2", null, isSmall ? "Timeline of the smallest case" : ran ? `Timeline ${ran}` : "Timeline"), place,
      facts(index),
      ...visitsOf(index),
      ...(text === undefined ? [] : [h("h2", null, "The case"), h("p", { class: "about" }, h("code", null, details().paths[index])), h("pre", { tabindex: "0", class: "text" }, text)]),
    );
    return openTimeline(content, place, index, isSmall ? small : null);
  }

  /** Returns the smallest case that fails as a case does: `{run, sizes, command, matters}`; null if there is none. */
  function smallestOf(index) {
    const found = failuresOf(index).map(([, , , cause]) => columns().smallest[cause]).find(Boolean);
    if (!found) return null;
    const [run, sizes, again, matters] = found;
    return { run, sizes, again, matters };
  }

  /** Returns the choice between the smallest case and the case as it was found, or why there is no smallest one. */
  function formsOf(index, small, isSmall) {
    if (!small) return h("p", { class: "about", "data-notice": "no-smallest" }, columns().no_smallest[index] ?? "");
    const form = (name, words, isShown) => h("a", { href: caseAddress(columns().label[index], null, name), "aria-current": isShown ? "true" : null }, words);
    return h("div", { class: "forms" },
      h("p", { class: "form-names" }, form("smallest", "Smallest case", isSmall), " ", form("found", "As found", !isSmall)),
      isSmall ? h("p", { "data-smallest": small.sizes }, `${small.sizes}. `, small.again ? command(small.again) : "") : "",
      isSmall ? h("ul", { class: "matters" }, small.matters.map((choice) => h("li", null, `It matters: ${choice}`))) : "");
  }

  function openTimeline(content, place, index, small) {
    let timeline = null;
    let isLeft = false;
    const put = (words, notice) => place.replaceChildren(h("p", { class: "about", "data-notice": notice }, words));
    const open = async () => {
      const data = await timelines().load(small?.run ?? index);
      if (isLeft) return;
      if (data !== null) timeline = openSteps(content, place, index, data, small ? "smallest" : "");
      else if (placeOf(index) && details().commands[index]) put("There is no timeline: another version of scbm wrote the log, and it cannot be replayed.", "log-of-another-version");
      else if (details().commands[index]) put("There is no timeline: this report has those of the cases that its other pages name.", "no-timeline");
      else put("There is no timeline: the case was not run again for this report.", "not-run-again");
    };
    open().catch((error) => { if (!isLeft) put(`This browser cannot show the timeline: ${error.message}`, "broken-timeline"); });
    return () => { isLeft = true; selectStep = null; timeline?.destroy(); };
  }

  /** Shows the steps of a run, first that of the address, else the first one that failed; its address follows them. */
  function openSteps(content, place, index, run, form) {
    const label = columns().label[index];
    const last = run.records.length;
    const isStep = (step) => step === null || (step >= 1 && step <= last);
    const asked = isStep(shown.step) ? shown.step : null;
    const failed = run.failures.length ? Math.min(...run.failures.map(({ record }) => record)) : null;
    const record = asked === null ? (failed ?? 0) : asked - 1;
    place.replaceChildren(asked === shown.step ? "" : h("p", { class: "notice", "data-notice": "no-step" }, `There is no step ${shown.step}: the run has ${counted(last, "step")}.`));
    const timeline = showTimeline(place, run, { record, label, onSelect: (selected) => rename(caseAddress(label, selected, form)) });
    content.querySelector(".failures")?.replaceChildren(...run.failures.map(({ message, record: at }) => h("li", null, h("a", { href: caseAddress(label, at, form) }, message))));
    selectStep = (step) => {
      if (step === null || !isStep(step)) return false;
      timeline.select(step - 1);
      reveal(timeline);
      return true;
    };
    if (asked !== null || failed !== null) reveal(timeline);
    return timeline;
  }

  /** Scrolls until the lane of the selected step is in the window, with as much above it as fits. */
  function reveal(timeline) {
    const { top, bottom } = timeline.laneOfSelected();
    if (bottom > innerHeight - 24) scrollBy(0, bottom - innerHeight + 24);
    else if (top < 60) scrollBy(0, top - 60);
  }

  /** Returns the previous and the next case of those listed last, or of all. */
  function beside(index, step) {
    const listed = order?.includes(index) ? order : columns().label.map((_, i) => i);
    return listed[listed.indexOf(index) + step];
  }

  function neighbours(index) {
    const link = (step, words) => {
      const other = beside(index, step);
      return other === undefined ? "" : h("a", { href: caseAddress(columns().label[other]), class: step < 0 ? "previous" : "next", title: columns().label[other] }, words);
    };
    const listed = order?.includes(index) ? order : null;
    const where = listed ? `${listed.indexOf(index) + 1} of ${listed.length}` : `${index + 1} of ${columns().label.length}`;
    return h("div", { class: "steps-between" }, h("a", { href: lastList }, "Cases"), h("span", { "data-place": where }, where), link(-1, "← previous"), link(1, "next →"));
  }

  function facts(index) {
    const c = columns();
    const fact = (name, value) => h("div", { "data-fact": name }, h("dt", null, name), h("dd", null, value));
    return h("dl", { class: "facts" }, fact("Goal", c.goals[c.goal[index]]), fact(placeOf(index) ? "Time" : "Simulated", seconds(c.ended_ns[index])),
      fact("Requests", String(c.requests[index])), fact("Obligations visited", String(c.visits[index])),
      fact("Visited only by it", String(c.only[index])));
  }

  /** Returns the obligations that only this case visits, and all that it visits, by subject. */
  function visitsOf(index) {
    const c = columns();
    const set = c.sets[c.set[index]];
    const visited = c.obligations.flatMap((obligation, bit) => (visits(set, bit) ? [{ obligation, bit }] : []));
    const own = visited.filter(({ bit }) => columns().visitors[bit] === 1);
    const queued = visited.filter(({ obligation: [, aspect] }) => aspect === "queued").length;
    const all = `All that it visits: ${visited.length - queued}${queued ? `, and ${queued} queued` : ""}`;
    return [
      h("h2", null, "Visited only by it"),
      own.length ? listOfVisits(own, "own") : h("p", { class: "about" }, "Nothing: other cases visit all that it visits."),
      h("details", null, h("summary", { "data-visited": visited.length - queued, "data-queued": queued }, all), listOfVisits(visited, "all")),
    ];
  }

  /** Returns the visited aspects by subject, each a link to the cases that visit it. */
  function listOfVisits(some, name) {
    const link = ({ obligation, bit }) => h("a", {
      href: casesThatVisit(nameOf(obligation)), title: `visited by ${counted(columns().visitors[bit], "case")}`,
    }, obligation[1]);
    return h("ul", { class: `visits ${name}` }, [...grouped(some)].map(([subject, found]) => h("li", null,
      subjectLink(subject, found[0].obligation), ": ", found.flatMap((each, place) => [place ? ", " : "", link(each)]))));
  }

  function subjectLink(subject, [, aspect]) {
    return aspect === "taken" ? h("b", null, `automatic/${subject}`) : h("a", { href: `#/operation/${encodeURIComponent(subject)}`, class: "subject" }, subject);
  }

  function grouped(some) {
    const groups = new Map();
    for (const each of some) {
      const key = `${each.obligation[1] === "taken"}/${each.obligation[0]}`;
      if (!groups.has(key)) groups.set(key, []);
      groups.get(key).push(each);
    }
    return [...groups].map(([key, found]) => [key.replace(/^[a-z]+\//, ""), found]);
  }

  // ---- tables of the first pages: sorting, filtering, hiding

  function makeSortable(table) {
    for (const [column, head] of [...table.tHead.rows[0].cells].entries()) {
      const button = h("button", { type: "button", onclick: () => sortRows(table, column, head) }, head.textContent);
      head.replaceChildren(button);
    }
  }

  function sortRows(table, column, head) {
    const sign = head.getAttribute("aria-sort") === (head.classList.contains("number") ? "descending" : "ascending") ? -1 : 1;
    const isAscending = head.classList.contains("number") ? sign < 0 : sign > 0;
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", isAscending ? "ascending" : "descending");
    const value = (row) => row.cells[column].dataset.value ?? row.cells[column].textContent;
    const rows = [...table.tBodies[0].rows].map((row, place) => ({ row, place, value: value(row) }));
    rows.sort((a, b) => (isAscending ? 1 : -1) * collator.compare(a.value, b.value) || a.place - b.place);
    table.tBodies[0].append(...rows.map(({ row }) => row));
  }

  function sift(page) {
    const words = (page.querySelector("input.filter")?.value ?? "").toLowerCase().split(/\s+/).filter(Boolean);
    const hides = page.querySelector("input.hide-covered")?.checked;
    let left = 0;
    for (const row of page.querySelectorAll("tbody tr")) {
      const cells = [...row.cells].filter((cell) => !cell.querySelector(".command"));
      const text = cells.map((cell) => cell.textContent).join("\n").toLowerCase();
      row.hidden = !words.every((word) => text.includes(word)) || Boolean(hides && row.classList.contains("covered"));
      left += !row.hidden;
    }
    for (const entry of page.querySelectorAll("details:is(.entry, .group)")) {
      entry.hidden = ![...entry.querySelectorAll("tbody tr")].some((row) => !row.hidden);
      if (words.length) entry.open = !entry.hidden;
    }
    const none = page.querySelector(".none");
    if (none) none.hidden = left > 0;
    say(`${counted(left, "row")} left`);
  }

  // ---- the picture of all obligations

  /** Returns the obligation below the pointer: its subject and its aspect; null if the row is shorter. */
  function cellAt(event) {
    const cells = event.currentTarget;
    const box = cells.getBoundingClientRect();
    const at = (position, size, name) => Math.floor((position / size) * Number(cells.style.getPropertyValue(name)));
    const aspect = columns().strip[at(event.clientY - box.top, box.height, "--rows")];
    const subjects = columns().obligations.flatMap(([subject, of]) => (of === aspect ? [subject] : []));
    const subject = subjects[at(event.clientX - box.left, box.width, "--columns")];
    return subject ? [subject, aspect] : null;
  }

  function nameCell(event) {
    const cell = cellAt(event);
    const bit = cell && bitOf().get(nameOf(cell));
    event.currentTarget.parentElement.querySelector(".strip-name").textContent = cell
      ? `${columns().marks[bit]} ${nameOf(cell)}: ${counted(columns().visitors[bit], "case")}` : "";
  }

  function openCell(event) {
    const cell = cellAt(event);
    if (cell) go(cell[1] === "taken" ? casesThatVisit(nameOf(cell)) : `#/operation/${encodeURIComponent(cell[0])}`);
  }

  // ---- the source

  const holes = () => [...byId("/source").querySelectorAll(".line:is(.missed, .partly)")];
  const firstHole = () => holes()[0];

  /** Marks a line with something missing and scrolls to it; does nothing without one. */
  function showHole(line) {
    if (line) showLine(line.id.replace("/source/", ""));
  }

  /** Goes to the next or the previous line with something missing, from the marked one or that of the address. */
  function nextHole(direction) {
    if (shown.page !== "source") return;
    const numberOf = (line) => Number(line?.querySelector(".no").textContent ?? 0);
    const here = numberOf(byId("/source").querySelector(".line.target"));
    const found = direction > 0 ? holes().find((line) => numberOf(line) > here) : holes().findLast((line) => numberOf(line) < here);
    if (!found) return;
    showHole(found);
    rename(`#${found.id}`);
    say(`Line ${numberOf(found)}`);
  }

  const TOKENS = /(?<comment>(?:^|\s)#.*$)|(?<key>^\s*-?\s*[\w.[\]<>-]+(?=\s*:(?:\s|$))|(?<=[{,]\s*)\w+(?=:\s))|(?<text>"[^"]*"|'[^']*')/g;

  /** Colours comments, keys and texts of the source by highlights, which add no element to the document. */
  const colourSource = once(() => {
    if (!globalThis.CSS?.highlights) return;
    for (const { line } of sourceLines()) {
      const node = line.querySelector("code").firstChild;
      for (const found of node?.data.matchAll(TOKENS) ?? []) {
        const name = `scbm-${Object.keys(found.groups).find((group) => found.groups[group] !== undefined)}`;
        if (!CSS.highlights.has(name)) CSS.highlights.set(name, new Highlight());
        const range = new StaticRange({ startContainer: node, startOffset: found.index, endContainer: node, endOffset: found.index + found[0].length });
        CSS.highlights.get(name).add(range);
      }
    }
  });

  /** Hides blocks of lines without missing obligations behind buttons with their numbers; or shows all again. */
  function fold(source, isWanted) {
    for (const button of source.querySelectorAll(".folded")) button.remove();
    const lines = [...source.querySelectorAll(".line")];
    const kept = isWanted ? keptLines(lines) : new Set(lines);
    let run = [];
    for (const line of [...lines, null]) {
      if (line && !kept.has(line)) run.push(line);
      else {
        if (run.some((each) => each.matches(".visited")) || run.length > FEW_LINES) hideRun(run);
        else for (const each of run) each.hidden = false;
        if (line) line.hidden = false;
        run = [];
      }
    }
  }

  /** Returns the lines with missing obligations, and the first line of the operation that each belongs to. */
  function keptLines(lines) {
    const kept = new Set();
    let head = null;
    for (const line of lines) {
      if (line.matches(".head")) head = line;
      if (line.matches(".missed, .partly")) kept.add(line).add(head ?? line);
    }
    return kept;
  }

  function hideRun(run) {
    const numberOf = (line) => line.querySelector(".no").textContent;
    const words = run.length === 1 ? `⋯ line ${numberOf(run[0])}` : `⋯ lines ${numberOf(run[0])} to ${numberOf(run.at(-1))}`;
    for (const line of run) line.hidden = true;
    run[0].before(h("button", { type: "button", class: "folded", "data-first": numberOf(run[0]), onclick: (event) => open(event.target, run) }, words));
  }

  function open(button, run) {
    for (const line of run) line.hidden = false;
    button.remove();
  }

  function unfold(line) {
    let before = line;
    while (before && !before.matches(".folded")) before = before.previousElementSibling;
    before?.click();
  }

  // ---- search in the header

  function found(text) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    const fits = (candidate) => { const lower = candidate.toLowerCase(); return words.every((word) => lower.includes(word)); };
    const c = columns();
    const operations = c.operations.filter(fits).map((name) => [name, `#/operation/${encodeURIComponent(name)}`]);
    const obligations = c.obligations.flatMap((each, bit) => (fits(nameOf(each)) ? [foundObligation(each, bit)] : []));
    const cases = [];
    for (const [index, searchable] of searched().entries()) if (words.every((word) => searchable.includes(word))) cases.push(index);
    const lines = sourceLines().filter((line) => fits(line.text)).map((line) => [`${line.number}  ${line.text.trim()}`, `#/source/${line.number}`]);
    return [
      ["Operations", operations],
      ["Obligations", obligations],
      ["Cases", cases.slice(0, MOST_FOUND).map((index) => [c.label[index], caseAddress(c.label[index])]), cases.length, addressOf(new URLSearchParams(), { q: text.trim() })],
      ["Lines", lines],
    ];
  }

  /** Returns an obligation with a link to its cases, or to the reason why it has none. */
  function foundObligation(obligation, bit) {
    const name = nameOf(obligation);
    const mark = columns().marks[bit];
    if (columns().visitors[bit]) return [`${mark} ${name}`, casesThatVisit(name)];
    return [`${mark} ${name}`, obligation[1] === "taken" ? "#/missing" : `#/operation/${encodeURIComponent(obligation[0])}`];
  }

  function search() {
    const text = byId("search").value;
    if (!text.trim()) return closeResults();
    const entries = found(text).filter(([, some]) => some.length).flatMap(([title, some, count, all]) => [
      h("div", { class: "group", role: "presentation", "data-group": title, "data-count": count ?? some.length }, `${title}, ${count ?? some.length}`),
      ...some.slice(0, MOST_FOUND).map(([words, address]) => option(words, address)),
      ...(all && count > some.length ? [option(`all ${count} cases`, all)] : []),
    ]);
    for (const [place, entry] of entries.entries()) if (entry.matches("a")) entry.id = `result-${place}`;
    byId("results").replaceChildren(...(entries.length ? entries : [h("p", { class: "none", "data-notice": "nothing-found" }, "Nothing found")]));
    byId("results").hidden = false;
    byId("search").setAttribute("aria-expanded", "true");
    select(byId("results").querySelector("a"));
    return undefined;
  }

  const option = (words, address) => h("a", { href: address, role: "option", tabindex: "-1", "aria-selected": "false" }, words);

  function select(entry) {
    for (const other of document.querySelectorAll("#results a[aria-selected='true']")) other.setAttribute("aria-selected", "false");
    entry?.setAttribute("aria-selected", "true");
    entry?.scrollIntoView({ block: "nearest" });
    if (entry) byId("search").setAttribute("aria-activedescendant", entry.id);
    else byId("search").removeAttribute("aria-activedescendant");
  }

  function closeResults() {
    byId("results").hidden = true;
    byId("search").setAttribute("aria-expanded", "false");
    byId("search").removeAttribute("aria-activedescendant");
  }

  function searchKey(event) {
    const entries = [...byId("results").querySelectorAll("a")];
    const place = entries.findIndex((entry) => entry.getAttribute("aria-selected") === "true");
    const steps = { ArrowDown: 1, ArrowUp: -1 };
    if (event.key in steps && entries.length) {
      select(entries[(place + steps[event.key] + entries.length) % entries.length]);
      event.preventDefault();
    } else if (event.key === "Enter" && place >= 0 && !byId("results").hidden) {
      byId("search").blur();
      entries[place].click();
      closeResults();
    } else if (event.key === "Escape") {
      byId("search").value = "";
      closeResults();
      byId("search").blur();
    }
  }

  // ---- theme, copies, keys

  const THEMES = ["auto", "light", "dark"];

  function setTheme(theme) {
    root.dataset.theme = theme;
    byId("theme").querySelector("span").textContent = theme;
    byId("theme").setAttribute("aria-label", `Theme: ${theme}`);
    try {
      localStorage.setItem("scbm-theme", theme);
    } catch {
      // the choice lasts as long as the page is open
    }
  }

  const nextTheme = () => setTheme(THEMES[(THEMES.indexOf(root.dataset.theme) + 1) % THEMES.length]);

  async function copy(button) {
    const text = button.previousElementSibling.textContent;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      copyOldWay(text);
    }
    const show = (words, isCopied) => { button.textContent = words; button.toggleAttribute("data-copied", isCopied); };
    show("Copied", true);
    for (const leaving of ["blur", "pointerleave"]) button.addEventListener(leaving, () => show("Copy", false), { once: true });
    say("Copied");
  }

  function copyOldWay(text) {
    const area = h("textarea", { class: "vh" });
    area.value = text;
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }

  function step(direction) {
    if (shown.page === "case") document.querySelector(`.page.shown .${direction}`)?.click();
    else if (shown.page === "cases") document.querySelector(`.page.shown .pager .${direction}:not(:disabled)`)?.click();
  }

  function hideCovered() {
    document.querySelector(".page.shown input:is(.hide-covered, .fold)")?.click();
  }

  const KEYS = {
    "/": () => { byId("search").focus(); byId("search").select(); },
    "?": () => byId("help").showModal(),
    m: () => go("#/missing"), o: () => go("#/operations"), d: () => go("#/model"), s: () => go("#/source"), c: () => go("#/cases"),
    g: () => go("#/growth"), f: () => go("#/findings"),
    j: () => nextHole(1), k: () => nextHole(-1),
    n: () => step("next"), p: () => step("previous"), h: hideCovered, t: nextTheme,
  };

  function key(event) {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest?.("input:not([type=checkbox]), textarea, select, dialog[open]")) return;
    const act = KEYS[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  // ---- begin

  setTheme(THEMES.includes(root.dataset.theme) ? root.dataset.theme : "auto");
  for (const table of document.querySelectorAll("table.sortable")) makeSortable(table);
  addCopyButtons(document);
  document.querySelector(".strip-cells")?.addEventListener("pointermove", nameCell);
  document.querySelector(".strip-cells")?.addEventListener("click", openCell);
  addEventListener("hashchange", show);
  addEventListener("keydown", key);
  addEventListener("scroll", () => { if (shown.address === location.hash) positions.set(shown.address, scrollY); }, { passive: true });
  byId("theme").addEventListener("click", nextTheme);
  byId("help-button").addEventListener("click", () => byId("help").showModal());
  byId("search").addEventListener("input", search);
  byId("search").addEventListener("focus", search);
  byId("search").addEventListener("keydown", searchKey);
  document.addEventListener("click", (event) => {
    if (!event.target.closest(".search")) closeResults();
    const link = event.target.closest('a[href^="#"]');
    if (link?.matches(".skip")) {
      event.preventDefault(); // the fragment is not a page
      document.querySelector(".page.shown h1").focus();
    } else if (link) {
      follow(link.hash);
    }
    const button = event.target.closest("button");
    if (button?.matches(".copy")) copy(button);
    if (button?.matches("button.gutter")) {
      button.setAttribute("aria-expanded", String(button.parentElement.classList.toggle("open")));
    }
    const line = event.target.closest('.gutter')?.closest('.line[id]');
    if (line) {
      rename(`#${line.id}`); // to be copied
      markLine(line.id.replace("/source/", ""));
    }
  });
  document.addEventListener("input", (event) => {
    const page = event.target.closest(".page");
    if (event.target.matches("input.filter, input.hide-covered")) sift(page);
    if (event.target.matches("input.fold")) fold(page.querySelector(".source"), event.target.checked);
  });
  show();
})();
