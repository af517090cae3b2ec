// The machines that work.
import type {Worker} from './api';
import {el} from './dom';
import {gigabytes} from './format';

function card(worker: Worker, open: (id: number) => void): HTMLElement {
  const slots = Array.from({length: worker.slots}, (_, slot) => {
    const job = worker.running[slot];
    if (!job) return el('div', {class: 'slot idle'}, 'idle');
    return el('button', {class: 'slot', title: job.phase, onclick: () => open(job.id)}, el('span', {class: 'mono'}, job.name),
        el('progress', {value: job.progress, max: 1, 'aria-label': 'progress'}));
  });
  return el('div', {class: 'worker ' + worker.state}, el('strong', {}, worker.host), el('span', {class: 'tag'}, worker.state),
      el('span', {class: 'hint'}, `${worker.cores} cores · ${gigabytes(worker.ram_mb)} memory · ${gigabytes(worker.free_disk_mb)} free disk`), ...slots);
}

export const workerCards = (workers: Worker[], open: (id: number) => void) => [
  el('h3', {}, 'Workers'),
  workers.length ? el('div', {class: 'workers'}, ...workers.map(worker => card(worker, open))) :
                   el('p', {class: 'hint'}, 'No worker has reported yet.'),
];
