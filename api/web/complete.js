// What may stand at a place of a scene, by its JSON Schema. The text may be half-typed: it is scanned, not parsed.

/** `{ from, to, items: [{ label, detail, insert }] }` for the caret, or null where there is nothing to say. */
export function completionsAt(text, caret, schema) {
  const place = placeAt(text, caret);
  if (!place) return null;
  const found = schemasAt(text, place.stack, schema);
  const items = place.role === "key" ? keyItems(found, place, text) : valueItems(found, place, text);
  const typed = text.slice(place.from, caret).replace(/^"/, "").toLowerCase();
  const fitting = items.filter((item) => item.label.toLowerCase().includes(typed));
  fitting.sort((a, b) => b.label.toLowerCase().startsWith(typed) - a.label.toLowerCase().startsWith(typed));
  return fitting.length ? { from: place.from, to: place.to, items: fitting } : null;
}

/** The open brackets around the caret, whether a key or a value stands there, and what is typed of it. */
function placeAt(text, caret) {
  const stack = [];
  let from = caret;
  for (let i = 0; i < caret; ) {
    const frame = stack.at(-1);
    const end = tokenEnd(text, i);
    if (end > i) {
      // At its very end a word is still being typed; a string is over with its closing quote.
      const closed = text[i] === '"' && end > i + 1 && text[end - 1] === '"';
      if (end > caret || (end === caret && !closed)) {
        from = i;
        break;
      }
      if (text[i] === '"' && frame?.kind === "{" && !frame.colon) {
        frame.key = text.slice(i + 1, end - 1);
        frame.keys.push(frame.key);
      }
      i = end;
      continue;
    }
    if (text[i] === "{" || text[i] === "[") stack.push({ kind: text[i], start: i, key: null, keys: [], colon: false });
    else if (text[i] === "}" || text[i] === "]") stack.pop();
    else if (text[i] === ":" && frame) frame.colon = true;
    else if (text[i] === "," && frame) Object.assign(frame, { colon: false, key: null });
    i += 1;
  }
  const frame = stack.at(-1);
  if (!frame) return null;
  // A string that is not closed yet seems to go on to the next quote: what is replaced is the word at the caret.
  const rest = from < caret ? text.slice(caret).match(text[from] === '"' ? /^[\w-]*"?/ : /^[\w.+-]*/)[0] : "";
  const to = caret + rest.length;
  return { stack, from, to, role: frame.kind === "{" && !frame.colon ? "key" : "value" };
}

/** Where the string, number or word that begins at `i` ends; `i` if none does. A string ends with its line. */
function tokenEnd(text, i) {
  const pattern = text[i] === '"' ? /"(?:[^"\\\n]|\\.)*"?/y : /[\w.+-]+/y;
  pattern.lastIndex = i;
  return pattern.test(text) ? pattern.lastIndex : i;
}

/** The schemas that hold for what is inside the innermost bracket. */
function schemasAt(text, stack, root) {
  let found = branches(root, root);
  stack.forEach((frame, depth) => {
    if (frame.kind === "{") found = byType(found, memberOf(text, frame.start, "type"));
    const inner = stack[depth + 1];
    if (!inner) return;
    found = found.flatMap((schema) => below(schema, frame)).flatMap((schema) => branches(schema, root));
  });
  return { found, root };
}

function below(schema, frame) {
  if (frame.kind === "[") return schema.items ? [schema.items] : [];
  const member = schema.properties?.[frame.key] ?? schema.additionalProperties;
  return typeof member === "object" ? [member] : [];
}

/** A schema with its references followed and its choices apart. */
function branches(schema, root) {
  const reference = schema.$ref?.match(/^#\/\$defs\/(.+)$/);
  const own = reference ? { ...root.$defs[reference[1]], ...schema, $ref: undefined } : schema;
  const choices = own.oneOf ?? own.anyOf;
  return choices ? choices.flatMap((choice) => branches(choice, root)) : [own];
}

function byType(schemas, type) {
  const same = schemas.filter((schema) => schema.properties?.type?.const === type);
  return type !== null && same.length ? same : schemas;
}

/** The value of a text member of the object that begins at `start`, wherever it stands in it. */
function memberOf(text, start, name) {
  let depth = 0;
  for (let i = start; i < text.length; ) {
    const end = tokenEnd(text, i);
    if (depth === 1 && end > i && text.slice(i, end) === `"${name}"`) {
      const value = /\s*:\s*"([^"\n]*)"/y;
      value.lastIndex = end;
      const match = value.exec(text);
      if (match) return match[1];
    }
    if (end === i) depth += "{[".includes(text[i]) ? 1 : "}]".includes(text[i]) ? -1 : 0;
    if (depth === 0) return null;
    i = Math.max(end, i + 1);
  }
  return null;
}

function keyItems({ found }, { stack, to }, text) {
  const frame = stack.at(-1);
  const after = text.slice(to).trimStart();
  const items = new Map();
  for (const schema of found) {
    for (const [key, member] of Object.entries(schema.properties ?? {})) {
      if (frame.keys.includes(key) || items.has(key)) continue;
      const needed = schema.required?.includes(key) ? "needed · " : "";
      items.set(key, { label: key, detail: needed + (member.description ?? ""), insert: `"${key}"${after.startsWith(":") ? "" : ": "}` });
    }
  }
  return [...items.values()].sort((a, b) => b.detail.startsWith("needed") - a.detail.startsWith("needed"));
}

function valueItems({ found, root }, { stack }, text) {
  const frame = stack.at(-1);
  const members = found.flatMap((schema) => below(schema, frame)).flatMap((schema) => branches(schema, root));
  const values = members.flatMap((member) => {
    const fixed = member.enum ?? ("const" in member ? [member.const] : member.type === "boolean" ? [true, false] : []);
    const list = fixed.length || !("default" in member) ? fixed : [member.default];
    return list.map((value) => ({ value, detail: member.description ?? "" }));
  });
  // The choice of a type is described where the type is.
  if (frame.key === "type") {
    for (const item of values) item.detail = found.find((schema) => schema.properties?.type?.const === item.value)?.description ?? "";
  }
  if (frame.key === "material") values.push(...materialsOf(text).map((value) => ({ value, detail: "a material of this scene" })));
  const items = values.map(({ value, detail }) => ({ label: labelOf(value), detail, insert: JSON.stringify(value) }));
  return [...new Map(items.map((item) => [item.insert, item])).values()];
}

function materialsOf(text) {
  const start = text.search(/"materials"\s*:\s*\{/);
  if (start < 0) return [];
  const names = [];
  let depth = 0;
  for (let i = text.indexOf("{", start); i < text.length; ) {
    const end = tokenEnd(text, i);
    if (depth === 1 && text[i] === '"' && /^\s*:/.test(text.slice(end, end + 8))) names.push(text.slice(i + 1, end - 1));
    if (end === i) depth += "{[".includes(text[i]) ? 1 : "}]".includes(text[i]) ? -1 : 0;
    if (depth === 0) break;
    i = Math.max(end, i + 1);
  }
  return names;
}

const labelOf = (value) => (typeof value === "string" ? value : JSON.stringify(value));
