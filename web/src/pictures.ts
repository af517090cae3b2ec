// Films, and the newest pictures of every stage that makes some.
import {api, type Film, type Job} from './api';
import {el} from './dom';

export const pictureKinds = ['render', 'correspond', 'depth', 'reconstruct', 'fuse', 'navspace', 'track', 'ingest'];
const titles: Record<string, string> = {
  ingest: 'Footage', track: 'Tracks', navspace: 'Navigation space', correspond: 'Flow', depth: 'Depth', render: 'Rendered frames',
  reconstruct: 'Patches', fuse: 'Model',
};

export interface Pictures {
  shot: number;
  films: Film[];
  rows: {kind: string; jobs: Job[]}[];
}

const film = (shot: number, item: Film) => el('figure', {},
    el('video', {src: api.out(shot, item.path), controls: true, loop: true, muted: true, preload: 'metadata'}),
    el('figcaption', {}, item.file));

const thumbnail = (job: Job, open: (id: number) => void) => el('figure', {},
    el('button', {class: 'picture', title: job.name, onclick: () => open(job.id)},
       el('img', {src: api.preview(job.id, job.key), alt: job.name, loading: 'lazy'})),
    el('figcaption', {}, job.name.slice(job.name.indexOf('/') + 1)));

function row(title: string, items: HTMLElement[]): HTMLElement {
  return el('div', {class: 'row'}, el('h3', {}, title), el('div', {class: 'strip'}, ...items));
}

export function gallery(pictures: Pictures, open: (id: number) => void): HTMLElement[] {
  const rows = pictures.films.length ? [row('Films', pictures.films.map(item => film(pictures.shot, item)))] : [];
  for (const {kind, jobs} of pictures.rows)
    if (jobs.length) rows.push(row(titles[kind] ?? kind, jobs.map(job => thumbnail(job, open))));
  return rows;
}
