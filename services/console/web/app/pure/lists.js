// Lists as the console gives them: bare, or under a name.

/** `value` itself when it is a list, `value[name]` when that is one, else an empty list. */
export function list(value, name = "") {
  if (Array.isArray(value)) return value;
  return Array.isArray(value?.[name]) ? value[name] : [];
}
