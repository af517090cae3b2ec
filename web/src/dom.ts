// A small element builder: el('div', {class: 'x', onclick: f}, 'text', child).

type Child = Node | string | null | undefined | false;
type Attributes = Record<string, string | number | boolean | ((event: Event) => void)>;

function fill(node: Element, attributes: Attributes, children: Child[]) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, '');
    else if (value !== false) node.setAttribute(name, String(value));
  }
  for (const child of children) if (child) node.append(child);
}

export function el(tag: string, attributes: Attributes = {}, ...children: Child[]): HTMLElement {
  const node = document.createElement(tag);
  fill(node, attributes, children);
  return node;
}

export function svg(tag: string, attributes: Attributes = {}, ...children: Child[]): SVGElement {
  const node = document.createElementNS('http://www.w3.org/2000/svg', tag);
  fill(node, attributes, children);
  return node;
}

export const byId = (id: string) => document.getElementById(id) as HTMLElement;

/// Rebuilds a part of the page only when what it shows has changed, so that nothing flickers or loses its place.
export function show(place: HTMLElement, value: unknown, build: () => Child[]) {
  const text = JSON.stringify(value);
  if (place.dataset.shown === text) return;
  place.dataset.shown = text;
  place.replaceChildren(...build().filter((child): child is Node | string => Boolean(child)));
}
