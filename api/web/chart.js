// The error of a render against its time, both on logarithmic axes: straight lines are power laws.

const SVG = "http://www.w3.org/2000/svg";
const HEIGHT = 200;
const WIDEST = 640;
const MARGIN = { left: 52, right: 10, top: 26, bottom: 40 };

/** Draws `[{ rounds, seconds, error }]` into an <svg>; hides it while there is nothing to compare. */
export function drawErrorChart(svg, history) {
  const points = history.filter((point) => point.seconds > 0 && point.error > 0);
  svg.toggleAttribute("hidden", points.length < 2);
  if (points.length < 2) return;
  // One unit is one pixel, so that the words are of one size on every screen.
  const width = Math.min(svg.parentElement.clientWidth || WIDEST, WIDEST);
  const [left, right, top, bottom] = [MARGIN.left, width - MARGIN.right, MARGIN.top, HEIGHT - MARGIN.bottom];
  const x = axis(points.map((point) => point.seconds), left, right);
  const y = axis(points.map((point) => point.error), bottom, top);
  const path = points.map((point) => `${x.at(point.seconds).toFixed(1)} ${y.at(point.error).toFixed(1)}`);
  const [first, last] = [points[0], points.at(-1)];
  svg.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
  svg.setAttribute("aria-label",
    `Estimated error fell from ${percent(first.error)} after ${seconds(first.seconds)} to ${percent(last.error)} after ${seconds(last.seconds)}`);
  svg.replaceChildren(
    text(0, 12, "start", "Estimated error", "title"),
    text(right, HEIGHT - 4, "end", "Time of rendering", "title"),
    ...x.ticks.flatMap((tick) => [
      make("path", { class: "axis", d: `M${x.at(tick)} ${top}V${bottom}` }),
      text(x.at(tick), bottom + 16, "middle", seconds(tick)),
    ]),
    ...y.ticks.flatMap((tick) => [
      make("path", { class: "axis", d: `M${left} ${y.at(tick)}H${right}` }),
      text(left - 7, y.at(tick) + 4, "end", percent(tick)),
    ]),
    make("path", { class: "line", d: `M${path.join("L")}` }),
    ...points.map((point) => make("circle", { class: "dot", cx: x.at(point.seconds), cy: y.at(point.error), r: 3 })),
  );
}

/** A logarithmic map of the values' range onto `from`..`to`, and round values within it. */
function axis(values, from, to) {
  let [low, high] = [Math.min(...values) / 1.12, Math.max(...values) * 1.12];
  const grow = Math.sqrt(Math.max(1, (4 * low) / high));
  [low, high] = [low / grow, high * grow];
  const at = (value) => from + ((to - from) * Math.log(value / low)) / Math.log(high / low);
  const decades = Array.from({ length: Math.ceil(Math.log10(high / low)) + 2 }, (_, i) => Math.floor(Math.log10(low)) + i);
  const within = (steps) => decades.flatMap((decade) => steps.map((step) => step * 10 ** decade)).filter((v) => v >= low && v <= high);
  const fine = within([1, 2, 5]);
  return { at, ticks: fine.length <= 6 ? fine : within([1]) };
}

function text(x, y, anchor, words, kind = "tick") {
  const element = make("text", { x, y, "text-anchor": anchor, class: kind });
  element.textContent = words;
  return element;
}

function make(tag, attributes) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

const percent = (fraction) => `${Number((100 * fraction).toPrecision(2))} %`;
const seconds = (time) => `${Number(time.toPrecision(2))} s`;
