// All addresses, from the service's own OpenAPI document.

import { make } from "./recent.js";

const $ = (id) => document.getElementById(id);
/** What most people come for comes first. */
const ORDER = ["renders", "pictures", "scenes", "assets", "access", "health"];
/** Deeper than this, schemas are named and not written out. */
const DEEPEST = 6;

start().catch((error) => $("addresses").append(make("p", "problem", `openapi.json cannot be read: ${error.message}`)));

async function start() {
  const answer = await fetch("/openapi.json");
  if (!answer.ok) throw new Error(answer.statusText);
  const openapi = await answer.json();
  $("about").textContent = `${openapi.info.description} Version ${openapi.info.version}.`;
  const groups = new Map(ORDER.map((tag) => [tag, []]));
  for (const [path, methods] of Object.entries(openapi.paths)) {
    for (const [method, operation] of Object.entries(methods)) {
      const tag = operation.tags?.[0] ?? "other";
      if (!groups.has(tag)) groups.set(tag, []);
      groups.get(tag).push(operationOf(openapi, method, path, operation));
    }
  }
  for (const [tag, operations] of groups) {
    if (!operations.length) continue;
    const title = Object.assign(make("h2", "", tag), { id: tag });
    $("contents").append(Object.assign(make("a", "", tag), { href: `#${tag}` }));
    $("addresses").append(title, ...operations);
  }
}

function operationOf(openapi, method, path, operation) {
  const box = make("details", "operation");
  const summary = make("summary");
  summary.append(make("span", "method", method.toUpperCase()), make("code", "", path), make("span", "", operation.summary ?? ""));
  const body = make("div");
  if (operation.description) body.append(make("p", "", operation.description));
  if (operation.security) body.append(make("p", "quiet", "Needs an API key where the service asks for one."));
  const parameters = (operation.parameters ?? []).map((one) => [one.name, `${one.in}${one.required ? ", needed" : ""}`, one.description ?? kindOf(openapi, one.schema)]);
  if (parameters.length) body.append(make("h3", "", "Parameters"), table(parameters));
  for (const [kind, { schema }] of Object.entries(operation.requestBody?.content ?? {})) {
    body.append(make("h3", "", `Body: ${kind}`), schemaOf(openapi, schema));
  }
  body.append(make("h3", "", "Answers"), answersOf(openapi, operation.responses));
  box.append(summary, body);
  return box;
}

function answersOf(openapi, responses) {
  const rows = Object.entries(responses).map(([status, response]) => {
    const [kind, content] = Object.entries(response.content ?? {})[0] ?? [];
    const shown = content?.schema && !status.startsWith("4") && !status.startsWith("5") ? schemaOf(openapi, content.schema) : "";
    const headers = Object.keys(response.headers ?? {});
    const words = make("div");
    words.append(response.description + (headers.length ? ` (${headers.join(", ")})` : ""), shown);
    return [status, kind ?? "", words];
  });
  return table(rows);
}

function table(rows) {
  const table = make("table");
  for (const cells of rows) {
    const row = make("tr");
    cells.forEach((cell, i) => {
      const element = make(i ? "td" : "th");
      element.append(cell);
      row.append(element);
    });
    row.firstChild.scope = "row";
    table.append(row);
  }
  return table;
}

/** A schema as a list of its members, those in it folded. */
function schemaOf(openapi, schema, depth = 0) {
  const own = resolved(openapi, schema);
  const choices = (own.oneOf ?? own.anyOf ?? []).filter((choice) => choice.type !== "null");
  const members = Object.entries(own.properties ?? {});
  if (depth > DEEPEST || !(choices.length || members.length)) return make("span", "quiet", kindOf(openapi, schema));
  const list = make("ul", "schema");
  for (const choice of choices) {
    const type = resolved(openapi, choice).properties?.type?.const;
    list.append(memberOf(openapi, type ? `type: ${type}` : "", choice, depth));
  }
  for (const [name, member] of members) {
    list.append(memberOf(openapi, own.required?.includes(name) ? `${name} *` : name, member, depth));
  }
  return list;
}

function memberOf(openapi, name, member, depth) {
  const item = make("li");
  const own = resolved(openapi, member);
  const words = [make("code", "", name), ` ${kindOf(openapi, member)}`, own.description ? `: ${own.description}` : ""];
  const inner = own.type === "array" ? own.items : own.additionalProperties || own;
  const target = resolved(openapi, typeof inner === "object" ? inner : {});
  if (!target.properties && !target.oneOf && !target.anyOf) {
    item.append(...words);
    return item;
  }
  const fold = make("details");
  const summary = make("summary");
  summary.append(...words);
  fold.append(summary);
  // Written when it is opened: a scene's schema is large, and refers to itself.
  fold.addEventListener("toggle", () => fold.open && fold.children.length === 1 && fold.append(schemaOf(openapi, inner, depth + 1)));
  item.append(fold);
  return item;
}

function resolved(openapi, schema) {
  if (!schema.$ref) return schema;
  return { ...openapi.components.schemas[schema.$ref.split("/").at(-1)], description: schema.description };
}

function kindOf(openapi, schema = {}) {
  if (schema.$ref) return schema.$ref.split("/").at(-1);
  if ("const" in schema) return JSON.stringify(schema.const);
  if (schema.enum) return schema.enum.map((value) => JSON.stringify(value)).join(" | ");
  const choices = schema.oneOf ?? schema.anyOf;
  if (choices) return choices.map((choice) => kindOf(openapi, choice)).join(" | ");
  const type = [schema.type ?? ""].flat().join(" | ");
  if (schema.type === "array" && schema.items) return `array of ${kindOf(openapi, schema.items)}`;
  return schema.format ? `${type} (${schema.format})` : type;
}
