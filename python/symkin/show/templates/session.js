"use strict";

// The page of a guided session: it shows the state that it asks for, and sends what is entered
// until it is answered. What was entered of an older state is not done twice.
const each = (id) => document.getElementById(id);
const token = new URLSearchParams(location.search).get("token") || "";
const keys = { s: "Skip", o: "Occluded", a: "Avoid region", r: "Repeat", u: "Undo" };
const pause = 2000; // ms between questions
const patience = 30000; // ms for an answer

let shown = null;
let sending = null;

const element = (name, text = "") => Object.assign(document.createElement(name), { textContent: text });
const wait = (time) => new Promise((done) => setTimeout(done, time));

// The answer to a question; null if nobody answers.
async function asked(path, told = null) {
  try {
    const answer = await fetch(path, {
      method: told ? "POST" : "GET",
      headers: { "Content-Type": "application/json", "X-Token": token },
      body: told && JSON.stringify(told),
      cache: "no-store",
      signal: AbortSignal.timeout(patience),
    });
    const found = await answer.json();
    each("lost").hidden = true;
    return { code: answer.status, found };
  } catch {
    each("lost").hidden = false;
    return null;
  }
}

function list(place, cells) {
  place.replaceChildren(...cells.map(([name, value, unit]) => {
    const cell = element("div");
    cell.append(element("dt", name), element("dd", `${value}${unit === "°" ? "" : " "}${unit}`));
    return cell;
  }));
}

function field({ name, unit, column, read }, told) {
  const label = element("label");
  const input = Object.assign(element("input"), {
    name: column, inputMode: "decimal", enterKeyHint: "next", placeholder: told,
  });
  const sign = Object.assign(element("button", "±"), { type: "button", ariaLabel: `sign of ${name}` });
  sign.onclick = () => {
    input.value = input.value.startsWith("-") ? input.value.slice(1) : `-${input.value}`;
    keep();
  };
  input.oninput = keep;
  label.append(element("span", unit ? `${name}, ${unit}` : name), input, sign);
  (read ? each("seen") : each("measured")).append(label);
}

const inputs = () => [...document.querySelectorAll("#row input")];

// What was typed is there after the page was closed, for the same pose.
function keep() {
  const typed = Object.fromEntries(inputs().map((input) => [input.name, input.value]));
  sessionStorage.setItem("typed", JSON.stringify({ tries: shown.tries, typed }));
}

function fields(state) {
  each("measured").replaceChildren();
  each("seen").replaceChildren();
  const readings = state.entries.filter((entry) => entry.read);
  state.entries.forEach((entry) => {
    const leg = readings.indexOf(entry);
    field(entry, leg < 0 ? "" : state.ask.readings[leg]?.[1] || "");
  });
  each("read").hidden = readings.length === 0 || readings.length === state.entries.length;
  if (readings.length === state.entries.length) each("measured").append(...each("seen").children);
  const kept = JSON.parse(sessionStorage.getItem("typed") || "{}");
  if (kept.tries !== state.tries) return;
  inputs().forEach((input) => { input.value = kept.typed[input.name] || ""; });
}

function decision(key, text) {
  const button = Object.assign(element("button", text), { type: "button" });
  button.dataset.key = key;
  button.onclick = () => tell({ key });
  return button;
}

function show(state) {
  const other = !shown || shown.tries !== state.tries || shown.ask?.again !== state.ask?.again;
  shown = state;
  each("progress").textContent = state.progress;
  each("bar").style.width = `${100 * state.share}%`;
  each("end").hidden = !state.end;
  each("end").textContent = [state.problem, state.end].filter(Boolean).join("\n\n");
  each("last").hidden = !state.last;
  each("last").className = `verdict ${Object.keys(state.decisions).length ? "doubtful" : "good"}`;
  each("last").firstElementChild.textContent = state.last;
  each("last").lastElementChild.replaceChildren(
    ...Object.entries(state.decisions).map(([key, text]) => decision(key, `${key}: ${text}`)));
  document.querySelector("main").hidden = !state.ask;
  each("keys").replaceChildren(...Object.entries(keys)
    .filter(([key]) => state.ask || key === "u" || key === "r")
    .filter(([key]) => !(key in state.decisions))
    .map(([key, text]) => decision(key, text)));
  if (!state.ask) {
    each("heading").textContent = state.robot;
    each("more").textContent = "";
    return;
  }
  const again = state.ask.again === null ? "" : `, row ${state.ask.again} again`;
  each("heading").textContent = `${state.ask.row}${again}`;
  each("more").textContent = state.robot;
  list(each("pose"), state.ask.pose);
  list(each("readings"), state.ask.readings);
  each("drawing").innerHTML = state.ask.drawing;
  if (other) fields(state);
}

// Sends what was entered until it is answered, and shows what came of it.
async function tell(what) {
  if (sending) return;
  sending = { tries: shown.tries, ...what };
  each("error").hidden = true;
  document.querySelectorAll("button").forEach((button) => { button.disabled = true; });
  let answer = await asked("tell", sending);
  while (answer === null) {
    await wait(pause);
    answer = await asked("tell", sending);
  }
  sending = null;
  document.querySelectorAll("button").forEach((button) => { button.disabled = false; });
  const { error, ...state } = answer.found;
  if ("tries" in state) show(state);
  if (error) {
    each("error").textContent = error;
    each("error").hidden = false;
    (shown.ask ? each("error") : each("end")).scrollIntoView({ block: "nearest" });
  } else if (what.row) {
    each("heading").scrollIntoView({ block: "nearest" });
  }
}

each("row").onsubmit = (event) => {
  event.preventDefault();
  tell({ row: Object.fromEntries(inputs().map((input) => [input.name, input.value])) });
};

async function follow() {
  for (;;) {
    const answer = sending ? null : await asked("state");
    if (answer?.code === 200 && !sending) show(answer.found);
    else if (answer && !sending) each("progress").textContent = answer.found.error;
    await wait(pause);
  }
}
follow();
