// The error of a render against its time, both on logarithmic axes: straight lines are power laws.

const SVG = "http://www.w3.org/2000/svg";
const BOX = { left: 46, right: 404, top: 8, bottom: 118 };

/** Draws `[{ rounds, seconds, error }]` into an <svg>; hides it while there is nothing to compare. */
export function drawErrorChart(svg, history) {
  const points = history.filter((point) => point.seconds > 0 && point.error > 0);
  svg.toggleAttribute("hidden", points.length < 2);
  if (points.length < 2) return;
  const x = axis(points.map((point) => point.seconds), BOX.left, BOX.right);
  const y = axis(points.map((point) => point.error), BOX.bottom, BOX.top);
  const path = points.map((point) => `${x.at(point.seconds).toFixed(1)} ${y.at(point.error).toFixed(1)}`);
  const [first, last] = [points[0], points.at(-1)];
  svg.setAttribute("aria-label",
    `Estimated error fell from ${percent(first.error)} after ${seconds(first.seconds)} to ${percent(last.error)} after ${seconds(last.seconds)}`);
  svg.replaceChildren(
    ...x.ticks.flatMap((tick) => [
      make("path", { class: "axis", d: `M${x.at(tick)} ${BOX.top}V${BOX.bottom}` }),
      text(x.at(tick), BOX.bottom + 14, "middle", seconds(tick)),
    ]),
    ...y.ticks.flatMap((tick) => [
      make("path", { class: "axis", d: `M${BOX.left} ${y.at(tick)}H${BOX.right}` }),
      text(BOX.left - 6, y.at(tick) + 4, "end", percent(tick)),
    ]),
    make("path", { class: "line", d: `M${path.join("L")}` }),
    ...points.map((point) => make("circle", { class: "dot", cx: x.at(point.seconds), cy: y.at(point.error), r: 2.6 })),
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

function text(x, y, anchor, words) {
  const element = make("text", { x, y, "text-anchor": anchor });
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
