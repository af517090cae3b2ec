// The table of jobs: filters and paging are the server's work, so a million jobs cost no more than fifty.
import type {Job, JobFilter, JobPage, Stage} from './api';
import {el} from './dom';
import {duration, gigabytes} from './format';
import {chip, groups} from './states';

export interface TableActions {
  filter: (change: Partial<JobFilter>) => void;
  turn: (after: string) => void;
  back: () => void;
  open: (id: number) => void;
}

function select(label: string, value: string, options: [string, string][], onChange: (value: string) => void): HTMLElement {
  const items = options.map(([key, text]) => el('option', {value: key, selected: key === value}, text));
  return el('select', {'aria-label': label, onchange: event => onChange((event.target as HTMLSelectElement).value)}, ...items);
}

export function tableControls(stages: Stage[], filter: JobFilter, act: TableActions): HTMLElement[] {
  const kinds: [string, string][] = [['', 'all stages'], ...stages.map((stage): [string, string] => [stage.kind, stage.kind])];
  const states: [string, string][] = [['', 'all states'], ...groups.map((group): [string, string] => [group.states.join(','), group.name])];
  return [
    el('h3', {}, 'Jobs'),
    select('Stage', filter.kind, kinds, kind => act.filter({kind, after: ''})),
    select('State', filter.state, states, state => act.filter({state, after: ''})),
    el('input', {id: 'find', type: 'search', placeholder: 'name contains…   ( / )', 'aria-label': 'Name contains', value: filter.text,
                 oninput: event => act.filter({text: (event.target as HTMLInputElement).value, after: ''})}),
  ];
}

function note(job: Job): string {
  if (job.error) return job.error;
  if (job.state === 'running' || job.state === 'leased') return job.phase;
  return job.reason;
}

function row(job: Job, act: TableActions): HTMLElement {
  const progress = job.state === 'running' && el('progress', {value: job.progress, max: 1, 'aria-label': 'progress'});
  return el('tr', {class: job.error ? 'bad' : '', tabindex: 0, onclick: () => act.open(job.id),
                   onkeydown: event => { if ((event as KeyboardEvent).key === 'Enter') act.open(job.id); }},
      el('td', {}, chip(job.state)),
      el('td', {class: 'mono'}, job.name),
      el('td', {class: 'note'}, progress || null, note(job)),
      el('td', {class: 'number'}, job.wall_ms ? duration(job.wall_ms) : ''),
      el('td', {class: 'number'}, job.peak_rss_mb ? gigabytes(job.peak_rss_mb) : ''),
      el('td', {class: 'number'}, job.num_attempts > 1 ? String(job.num_attempts) : ''));
}

export function table(page: JobPage, filter: JobFilter, pageNumber: number, act: TableActions): HTMLElement[] {
  if (!page.jobs.length && !page.after && !filter.after) return [el('p', {class: 'hint'}, 'No job matches.')];
  const head = el('tr', {}, ...['State', 'Job', 'What and why', 'Took', 'Memory', 'Attempts'].map((text, column) =>
      el('th', {class: column > 2 ? 'number' : ''}, text)));
  const place = filter.after ? `page ${pageNumber}` : page.after ? 'first page' : '';
  const of = page.total === null ? '' : `${page.total.toLocaleString('en')} jobs`;
  return [
    el('table', {}, el('thead', {}, head), el('tbody', {}, ...page.jobs.map(job => row(job, act)))),
    el('div', {class: 'pager'}, el('button', {class: 'quiet', disabled: !filter.after, onclick: act.back}, '‹ earlier'),
       el('span', {}, [of, place].filter(Boolean).join(' · ')),
       el('button', {class: 'quiet', disabled: !page.after, onclick: () => act.turn(page.after ?? '')}, 'later ›')),
  ];
}
