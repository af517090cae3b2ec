// Every state has a colour and a shape, so that neither colour vision nor print is needed to tell them apart.
import type {Counts, State} from './api';
import {el, svg} from './dom';

export interface Group {
  name: string;
  states: State[];
  path: string;  // on a 12 x 12 grid
  filled: boolean;
}

// In the order of a stacked bar. Colours are Okabe and Ito's, in style.css under .s-<name>.
export const groups: Group[] = [
  {name: 'done', states: ['done'], path: 'M1.5 6.5l3 3 6-7', filled: false},
  {name: 'up to date', states: ['skipped'], path: 'M1 6l2.5 3 4-6M7 8.5l1 .7 3.5-6', filled: false},
  {name: 'running', states: ['leased', 'running', 'reconnect'], path: 'M3 1.5l7 4.5-7 4.5z', filled: true},
  {name: 'failed', states: ['failed', 'quarantined', 'aborted'], path: 'M2 2l8 8M10 2l-8 8', filled: false},
  {name: 'canceled', states: ['canceled'], path: 'M6 1a5 5 0 100 10 5 5 0 000-10zM2.5 9.5l7-7', filled: false},
  {name: 'ready', states: ['ready'], path: 'M6 1.5a4.5 4.5 0 100 9 4.5 4.5 0 000-9z', filled: false},
  {name: 'waiting', states: ['blocked', 'paused'], path: 'M3.5 2v8M8.5 2v8', filled: false},
];

export const groupOf = (state: State) => groups.find(group => group.states.includes(state)) ?? groups[groups.length - 1]!;
const cssName = (group: Group) => 's-' + group.name.replaceAll(' ', '-');

export function glyph(group: Group) {
  const shape = svg('path', {d: group.path, fill: group.filled ? 'currentColor' : 'none', stroke: 'currentColor', 'stroke-width': 1.8,
                             'stroke-linecap': 'round', 'stroke-linejoin': 'round'});
  return svg('svg', {viewBox: '0 0 12 12', class: 'glyph ' + cssName(group), role: 'img', 'aria-label': group.name}, shape);
}

export const chip = (state: State) => el('span', {class: 'chip'}, glyph(groupOf(state)), state === 'skipped' ? 'up to date' : state);

export const countOf = (counts: Counts, group: Group) => group.states.reduce((sum, state) => sum + (counts[state] ?? 0), 0);
export const totalOf = (counts: Counts) => Object.values(counts).reduce((sum, n) => sum + (n ?? 0), 0);
export const finishedOf = (counts: Counts) => (counts.done ?? 0) + (counts.skipped ?? 0);

export function bar(counts: Counts) {
  const parts = groups.filter(group => countOf(counts, group) > 0).map(group => {
    const n = countOf(counts, group);
    return el('span', {class: cssName(group), style: `flex-grow:${n}`, title: `${n} ${group.name}`});
  });
  return el('div', {class: 'bar', role: 'img', 'aria-label': describe(counts)}, ...parts);
}

export const describe = (counts: Counts) =>
    groups.filter(group => countOf(counts, group) > 0).map(group => `${countOf(counts, group)} ${group.name}`).join(', ');

export const legend = (counts: Counts) => el('span', {class: 'legend'},
    ...groups.filter(group => countOf(counts, group) > 0)
        .map(group => el('span', {class: 'count', title: group.name}, glyph(group), String(countOf(counts, group)))));
