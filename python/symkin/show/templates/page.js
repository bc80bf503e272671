"use strict";

// A mechanism that follows its sliders. Everything but rigid motion was calculated beforehand, at
// the nodes of a grid (see symkin/report/movable.py).
function movable(figure) {
  const data = JSON.parse(figure.querySelector("script").textContent);
  const { axes, inner } = data;
  const allInner = inner.reduce((sum, each) => sum + each, 0);
  const legs = data.base.length;
  const free = allInner === 0;
  const spatial = data.dimensions === 3;
  const alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  const code = new Map([...alphabet].map((character, value) => [character, value]));
  const room = 2 * data.dimensions; // characters of a joint
  const width = 3 + room * allInner + 2 * data.bound.length;
  const place = [...data.home]; // on each axis, in nodes
  let step = -1; // of the planned poses, which are drawn as they are
  const view = { azimuth: -65, elevation: 22 };

  const svg = figure.querySelector("svg");
  const state = figure.querySelector("[role=status]");
  const bar = figure.querySelector(".measure > div");

  const pair = (at) => code.get(data.nodes[at]) * 64 + code.get(data.nodes[at + 1]);
  const at = (indices) => width * indices.reduce((row, i, k) => row * axes[k].values.length + i, 0);

  function value(k) {
    const values = axes[k].values;
    const low = Math.min(Math.floor(place[k]), values.length - 2);
    return values[low] + (place[k] - low) * (values[low + 1] - values[low]);
  }

  // The nodes about the pose with their weights: one, unless the mechanism moves freely.
  function about() {
    let found = [[[], 1]];
    for (const each of place) {
      const low = Math.floor(each);
      const share = each - low;
      found = found.flatMap(([indices, weight]) => [
        [[...indices, low], weight * (1 - share)],
        ...(share > 0 ? [[[...indices, low + 1], weight * share]] : []),
      ]);
    }
    return found.map(([indices, weight]) => [at(indices), weight]);
  }

  function turned([x, y, z = 0], rotation) {
    const angle = Math.hypot(...rotation);
    if (angle === 0) return [x, y, z];
    const [a, b, c] = rotation.map((each) => each / angle);
    const cosine = Math.cos(angle), sine = Math.sin(angle);
    const along = (a * x + b * y + c * z) * (1 - cosine);
    return [
      x * cosine + (b * z - c * y) * sine + a * along,
      y * cosine + (c * x - a * z) * sine + b * along,
      z * cosine + (a * y - b * x) * sine + c * along,
    ];
  }

  // All coordinates: those of the sliders, and those that the legs bind.
  function poseNow() {
    if (step >= 0) return data.steps[step].pose;
    const pose = [];
    data.free.forEach((coordinate, k) => { pose[coordinate] = value(k); });
    const nodes = about();
    data.bound.forEach(([coordinate, least, step], k) => {
      const start = width - 2 * (data.bound.length - k);
      const numbers = nodes.map(([node, weight]) => [pair(node + start), weight]);
      const known = numbers.filter(([number]) => number !== 4095);
      const whole = known.reduce((sum, [, weight]) => sum + weight, 0);
      pose[coordinate] = known.length
        ? known.reduce((sum, [number, weight]) => sum + weight * (least + number * step), 0) / whole
        : 0;
    });
    return pose;
  }

  // The least and the greatest value of a coordinate.
  function span(coordinate) {
    const k = data.free.indexOf(coordinate);
    if (k >= 0) return [axes[k].values[0], axes[k].values.at(-1)];
    const [, least, step] = data.bound.find(([each]) => each === coordinate);
    return [least, least + 4094 * step];
  }

  function moved(points) {
    const pose = poseNow();
    if (!data.moves) return points.map((point) => turned(point, pose));
    const rotation = spatial ? pose.slice(3) : [0, 0, pose[2] || 0];
    const position = spatial ? pose.slice(0, 3) : [pose[0], pose[1], 0];
    return points.map((point) => turned(point, rotation).map((each, k) => each + position[k]));
  }

  // Inner joints, wherever they go in the workspace.
  const wandering = [];
  for (let row = 0; row < data.nodes.length; row += width) {
    if (data.nodes[row] !== alphabet[0]) continue;
    for (let start = row + 3; start < row + 3 + room * allInner; start += room) {
      wandering.push(data.offset.map((low, k) => low + pair(start + 2 * k) * data.step));
    }
  }

  // What the view turns about.
  const tops = [...data.base, ...wandering].map(([, , z]) => z);
  const heights = spatial && data.moves
    ? [...tops, ...span(2)].reduce(
      ([low, high], z) => [Math.min(low, z), Math.max(high, z)], [Infinity, -Infinity])
    : [0];
  const middle = (Math.min(...heights) + Math.max(...heights)) / 2;

  // To the right and upwards on the drawing, in metres.
  function seen([x, y, z = 0]) {
    if (!spatial) return [x, y];
    const [a, e] = [view.azimuth, view.elevation].map((angle) => (angle * Math.PI) / 180);
    const towards = Math.cos(a) * x + Math.sin(a) * y;
    return [
      Math.cos(a) * y - Math.sin(a) * x, Math.cos(e) * (z - middle) - Math.sin(e) * towards];
  }

  function innerJoints(leg) {
    if (step >= 0) return data.steps[step].joints?.[leg] ?? [];
    const before = inner.slice(0, leg).reduce((sum, each) => sum + each, 0);
    const start = at(place) + 3 + room * before;
    const joints = [];
    for (let j = 0; j < inner[leg]; j += 1) {
      const numbers = data.offset.map((_, k) => pair(start + room * j + 2 * k));
      if (numbers.includes(4095)) return null;
      joints.push(numbers.map((number, k) => data.offset[k] + number * data.step));
    }
    return joints;
  }

  // What the drawing must hold: the base, and the platform wherever it goes.
  const reach = Math.max(...data.platform.map((point) => Math.hypot(...point)));
  const corners = !data.moves ? [[0, 0, 0]] : Array.from({ length: data.dimensions }, (_, k) => span(k)).reduce(
    (found, ends) => found.flatMap((c) => ends.map((end) => [...c, end])), [[]]);
  const box = (() => {
    const around = corners.flatMap((c) => [-reach, reach].flatMap((dx) =>
      [-reach, reach].map((dy) => [c[0] + dx, c[1] + dy, c[2] || 0])));
    const everything = [...data.base, ...around, ...wandering];
    if (!spatial) {
      const [xs, ys] = [0, 1].map((k) => everything.map((point) => point[k]));
      const extremes = (numbers) => numbers.reduce(
        ([low, high], each) => [Math.min(low, each), Math.max(high, each)], [Infinity, -Infinity]);
      return [extremes(xs), extremes(ys)];
    }
    // Seen from anywhere.
    if (!data.moves) return [[-1, 1], [-1, 1]];
    const radius = everything.reduce((most, [x, y]) => Math.max(most, Math.hypot(x, y)), 0);
    const tall = Math.hypot(radius, Math.max(...heights) - middle);
    return [[-radius, radius], [-tall, tall]];
  })();
  const margin = 24, wide = 500;
  const scale = (wide - 2 * margin) / (box[0][1] - box[0][0]);
  const high = scale * (box[1][1] - box[1][0]) + 2 * margin;
  svg.setAttribute("viewBox", `0 0 ${wide} ${high}`);
  const screen = (point) => {
    const [x, y] = seen(point);
    return [margin + scale * (x - box[0][0]), high - margin - scale * (y - box[1][0])];
  };

  const leave = (x) => x.toFixed(1);
  const listed = (points) => points.map((point) => screen(point).map(leave).join(",")).join(" ");
  const colour = (leg) => `var(--leg${(leg % 7) + 1})`;

  function drawnJoint([slides, actuated], point, leg) {
    const [x, y] = screen(point);
    const size = actuated ? 5 : 4;
    const look = `fill="${actuated ? colour(leg) : "var(--paper)"}" stroke="${colour(leg)}"`;
    return slides
      ? `<rect x="${leave(x - size)}" y="${leave(y - size)}" width="${2 * size}" height="${2 * size}" ${look}/>`
      : `<circle cx="${leave(x)}" cy="${leave(y)}" r="${size}" ${look}/>`;
  }

  // Beyond the base joint, away from the middle of the base.
  function number(leg) {
    const joints = data.base.map(screen);
    const [x, y] = joints[leg];
    const from = [0, 1].map((k) => joints.reduce((sum, each) => sum + each[k], 0) / legs);
    const far = Math.hypot(x - from[0], y - from[1]);
    const [right, down] = far > 1 ? [(x - from[0]) / far, (y - from[1]) / far] : [0, 1];
    const place = `x="${leave(x + 16 * right)}" y="${leave(y + 16 * down)}"`;
    return `<text ${place} fill="${colour(leg)}">${leg + 1}</text>`;
  }

  // A telescopic leg has its actuator half-way.
  function spread(centres, leg) {
    const missing = data.joints[leg].length - centres.length;
    const between = Array.from({ length: missing }, (_, j) =>
      centres[0].map((each, k) => each + ((j + 1) / (missing + 1)) * (centres[1][k] - each)));
    return [centres[0], ...between, ...centres.slice(1)];
  }

  // On a sphere links are arcs, the inner one of which begins below the elbow.
  function arcs(centres) {
    const axes = centres.map((c) => c.map((each) => each / Math.hypot(...c)));
    return [[0, 1, centres[0]], [1, 2, centres[2]]].flatMap(([from, to, end]) =>
      Array.from({ length: 17 }, (_, j) => {
        const chord = axes[from].map((each, k) => each + (j / 16) * (axes[to][k] - each));
        return chord.map((each) => (each * Math.hypot(...end)) / Math.hypot(...chord));
      }));
  }

  function draw() {
    const platform = moved(data.platform);
    const parts = [];
    if (data.outlines[0].length > 2) {
      parts.push(`<polygon class="base" points="${listed(data.outlines[0])}"/>`);
    }
    if (data.outlines[1].length > 2) {
      parts.push(`<polygon class="platform" points="${listed(moved(data.outlines[1]))}"/>`);
    }
    const lost = [];
    for (let leg = 0; leg < legs; leg += 1) {
      const between = innerJoints(leg);
      const name = number(leg);
      if (between === null) {
        lost.push(leg + 1);
        parts.push(name + drawnJoint(data.joints[leg][0], data.base[leg], leg));
        continue;
      }
      const centres = spread([data.base[leg], ...between, platform[leg]], leg);
      const rail = data.rails[leg];
      if (rail) {
        parts.push(`<polyline class="rail" points="${listed(rail)}"/>`);
      }
      const marked = rail ? [centres[1], ...centres.slice(1)] : centres; // carriage, not foot
      parts.push(
        `<g class="leg" stroke="${colour(leg)}"><polyline points="${listed(data.moves ? centres : arcs(centres))}"/>` +
        `${marked.map((each, j) => drawnJoint(data.joints[leg][j], each, leg)).join("")}</g>${name}`);
    }
    if (!spatial) {
      const [x, y] = screen(moved([[0, 0]])[0]);
      parts.push(`<circle class="grip" cx="${leave(x)}" cy="${leave(y)}" r="12"><title>Drag</title></circle>`);
    }
    svg.innerHTML = parts.join("");
    say(lost);
  }

  const named = (numbers) => `leg${numbers.length > 1 ? "s" : ""} ${numbers.join(", ")}`;
  const words = {
    inside: () => "A usable pose.",
    reach: (lost) => `Out of reach of ${lost.length ? named(lost) : "a leg"}.`,
    margin: () => `Nearer to the end of a leg's reach than ${data.margin}.`,
    limits: () => "Beyond the limits of an actuated joint.",
    aspect: () => "Beyond a parallel singularity, seen from home.",
    conditioning: () => `Too near a singularity: more than ${data.allowed} is not allowed.`,
    edge: () => "At the edge of what is usable.",
  };

  function say(lost) {
    if (step >= 0) {
      state.dataset.state = bar.parentElement.dataset.state = "inside";
      state.textContent = `Planned ${data.steps[step].name}, ${step + 1} of ${data.steps.length}.`;
      bar.style.width = "0";
      return;
    }
    const nodes = about();
    const states = new Set(nodes.map(([node]) => data.states[code.get(data.nodes[node])]));
    const key = states.size > 1 ? "edge" : [...states][0];
    const known = nodes.every(([node]) => pair(node + 1) !== 4095);
    const logarithm = nodes.reduce(
      (sum, [node, weight]) => sum + (weight * pair(node + 1) * data.decades) / 4094, 0);
    const condition = 10 ** logarithm;
    const digits = condition < 1000 ? condition.toPrecision(3) : condition.toFixed(0);
    const shown = logarithm >= data.decades ? `over ${10 ** data.decades}` : digits;
    const error = nodes.length > 1 ? ` (interpolated, within ${(100 * data.error).toPrecision(2)}%)` : "";
    state.dataset.state = key;
    state.textContent = words[key](lost) + (known ? ` Condition number ${shown}${error}.` : "");
    const full = Math.log10(Math.max(data.limit, 10));
    bar.style.width = known ? `${Math.min(100, (100 * logarithm) / full)}%` : "0";
    bar.parentElement.dataset.state = key;
  }

  const sliders = [];
  function control(label, least, most, step, start, show, set) {
    const row = document.createElement("label");
    const name = document.createElement("span");
    const input = document.createElement("input");
    const output = document.createElement("output");
    name.textContent = label;
    Object.assign(input, { type: "range", min: least, max: most, step, value: start });
    const refresh = () => { output.textContent = show(); };
    input.addEventListener("input", () => { set(Number(input.value)); refresh(); draw(); });
    row.append(name, input, output);
    figure.querySelector(".controls").append(row);
    refresh();
    return { input, refresh };
  }

  axes.forEach(({ name, unit, values }, k) => {
    const degrees = unit === "rad";
    const show = () => degrees
      ? `${((value(k) * 180) / Math.PI).toFixed(1)}\u00b0`
      : `${(1e3 * value(k)).toFixed(0)}\u00a0mm`;
    const finest = free ? 0.05 : 1;
    sliders.push(control(name, 0, values.length - 1, finest, place[k], show,
      (number) => { place[k] = number; step = -1; }));
  });
  if (spatial) {
    control("turn view", -180, 180, 1, view.azimuth, () => `${view.azimuth}\u00b0`,
      (number) => { view.azimuth = number; });
    control("tilt view", 0, 90, 1, view.elevation, () => `${view.elevation}\u00b0`,
      (number) => { view.elevation = number; });
  }
  const go = () => sliders.forEach(({ input, refresh }, k) => { input.value = place[k]; refresh(); });
  figure.querySelector("button").addEventListener("click", () => {
    data.home.forEach((each, k) => { place[k] = each; });
    step = -1;
    go();
    draw();
  });
  if (data.steps.length) {
    [["\u2190 pose", -1], ["pose \u2192", 1]].forEach(([label, way]) => {
      const button = document.createElement("button");
      Object.assign(button, { type: "button", textContent: label });
      button.addEventListener("click", () => {
        step = (Math.max(step, way < 0 ? 0 : -1) + way + data.steps.length) % data.steps.length;
        draw();
      });
      figure.querySelector("button").parentElement.insertBefore(button, figure.querySelector(".measure"));
    });
  }

  let dragged = false;
  svg.addEventListener("pointerdown", (event) => {
    dragged = event.target.classList.contains("grip");
    if (dragged) svg.setPointerCapture(event.pointerId);
  });
  svg.addEventListener("pointerup", () => { dragged = false; });
  svg.addEventListener("pointermove", (event) => {
    if (!dragged) return;
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(
      svg.getScreenCTM().inverse());
    const wanted = [
      (point.x - margin) / scale + box[0][0], (high - margin - point.y) / scale + box[1][0]];
    step = -1;
    wanted.forEach((coordinate, k) => {
      const distances = axes[k].values.map((each) => Math.abs(each - coordinate));
      place[k] = distances.indexOf(Math.min(...distances));
    });
    go();
    draw();
  });

  figure.hidden = false;
  draw();
}

// The nearest point that has a name says it beside the pointer.
function namedPoints(svg, tip) {
  const points = [...svg.querySelectorAll("[data-name]")];
  if (!points.length) return;
  const near = (event) => {
    const distance = (point) => {
      const { left, top, width, height } = point.getBoundingClientRect();
      return Math.hypot(event.clientX - left - width / 2, event.clientY - top - height / 2);
    };
    const distances = points.map(distance);
    const least = Math.min(...distances);
    tip.hidden = least > 12;
    if (tip.hidden) return;
    tip.textContent = points[distances.indexOf(least)].dataset.name;
    const left = Math.min(event.pageX + 12, document.documentElement.clientWidth - tip.offsetWidth - 4);
    tip.style.left = `${Math.max(0, left)}px`;
    tip.style.top = `${event.pageY + 14}px`;
  };
  svg.addEventListener("pointermove", near);
  svg.addEventListener("pointerdown", near);
  svg.addEventListener("pointerleave", () => { tip.hidden = true; });
}

document.querySelectorAll("figure.movable").forEach(movable);
document.querySelectorAll(".plot svg").forEach((svg) => namedPoints(svg, document.getElementById("tip")));
