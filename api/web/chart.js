// The error of a render against its rounds, both on logarithmic axes: straight lines are power laws.

const SVG = "http://www.w3.org/2000/svg";
const BOX = { left: 44, right: 312, top: 10, bottom: 88 };

/** Draws `[{ rounds, error }]` into an <svg>; hides it while there is nothing to compare. */
export function drawErrorChart(svg, points) {
  svg.toggleAttribute("hidden", points.length < 2);
  if (points.length < 2) return;
  const x = axis(points.map((point) => point.rounds), BOX.left, BOX.right);
  const y = axis(points.map((point) => point.error), BOX.bottom, BOX.top);
  const path = points.map((point) => `${x(point.rounds).toFixed(1)} ${y(point.error).toFixed(1)}`);
  const [first, last] = [points[0], points.at(-1)];
  svg.setAttribute("aria-label",
    `Estimated error fell from ${percent(first.error)} after round ${first.rounds} to ${percent(last.error)} after round ${last.rounds}`);
  svg.replaceChildren(
    make("path", { class: "axis", d: `M${BOX.left} ${BOX.top}V${BOX.bottom}H${BOX.right}` }),
    make("path", { class: "line", d: `M${path.join("L")}` }),
    make("circle", { class: "dot", cx: x(last.rounds), cy: y(last.error), r: 3.2 }),
    text(BOX.left - 5, y(first.error) + 4, "end", percent(first.error)),
    ...(Math.abs(y(last.error) - y(first.error)) > 14 ? [text(BOX.left - 5, y(last.error) + 4, "end", percent(last.error))] : []),
    text(x(first.rounds), BOX.bottom + 14, "start", String(first.rounds)),
    text(x(last.rounds), BOX.bottom + 14, "end", String(last.rounds)),
    text((BOX.left + BOX.right) / 2, BOX.bottom + 14, "middle", "rounds"),
  );
}

/** A logarithmic map of the values' range onto `from`..`to`. */
function axis(values, from, to) {
  const [low, high] = [Math.log(Math.min(...values)), Math.log(Math.max(...values))];
  return (value) => from + ((to - from) * (Math.log(value) - low)) / (high - low || 1);
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

const percent = (fraction) => `${(100 * fraction).toPrecision(2)} %`;
