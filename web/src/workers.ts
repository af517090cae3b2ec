// The machines that work.
import {api, type Worker} from './api';
import {el} from './dom';
import {gigabytes} from './format';
import {say} from './orders';

function drainButton(worker: Worker): HTMLElement | null {
  const verb = worker.state === 'draining' ? 'undrain' : worker.state === 'active' ? 'drain' : null;
  if (!verb) return null;
  const order = () => api.orderWorker(worker.id, verb).then(result => say(result.text), error => say(String(error), true));
  return el('button', {class: 'order', title: verb === 'drain' ? 'Finish what runs, take nothing new' : 'Take work again', onclick: () => void order()},
      verb === 'drain' ? 'Drain' : 'Take work');
}

function card(worker: Worker, mayOperate: boolean, open: (id: number) => void): HTMLElement {
  const slots = Array.from({length: worker.slots}, (_, slot) => {
    const job = worker.running[slot];
    if (!job) return el('div', {class: 'slot idle'}, 'idle');
    return el('button', {class: 'slot', title: job.phase, onclick: () => open(job.id)}, el('span', {class: 'mono'}, job.name),
        el('progress', {value: job.progress, max: 1, 'aria-label': 'progress'}));
  });
  return el('div', {class: 'worker ' + worker.state}, el('strong', {}, worker.host), el('span', {}, el('span', {class: 'tag'}, worker.state), mayOperate && drainButton(worker)),
      el('span', {class: 'hint'}, `${worker.cores} cores · ${gigabytes(worker.ram_mb)} memory · ${gigabytes(worker.free_disk_mb)} free disk${worker.hours && ' · ' + worker.hours}`),
      worker.set_aside && el('span', {class: 'hint warning'}, 'set aside: ' + worker.set_aside),
      worker.trouble && el('span', {class: 'hint warning'}, worker.trouble), ...slots);
}

export const workerCards = (workers: Worker[], mayOperate: boolean, open: (id: number) => void) => [
  el('h3', {}, 'Workers'),
  workers.length ? el('div', {class: 'workers'}, ...workers.map(worker => card(worker, mayOperate, open))) :
                   el('p', {class: 'hint'}, 'No worker has reported yet.'),
];
