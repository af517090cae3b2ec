// The banner of a shot and its pipeline: one card per stage.
import {api, type ShotDetail, type Stage} from './api';
import {el} from './dom';
import {duration} from './format';
import {bar, countOf, finishedOf, groups, legend, totalOf} from './states';

const failedGroup = groups.find(group => group.name === 'failed')!;
const runningGroup = groups.find(group => group.name === 'running')!;

function headline(shot: ShotDetail): string {
  const total = totalOf(shot.counts);
  const finished = finishedOf(shot.counts);
  const failed = countOf(shot.counts, failedGroup);
  const percent = total ? Math.floor(100 * finished / total) : 0;
  const words = [`${finished} of ${total} jobs`];
  if (shot.state === 'running') words.unshift(`${percent} % of what is planned so far`);
  if (failed) words.push(`${failed} failed`);
  const elapsed = (shot.finished_ms ?? Date.now()) - shot.submitted_ms;
  words.push(shot.state === 'running' ? `running for ${duration(elapsed)}` : `${shot.state} after ${duration(elapsed)}`);
  return words.join(' · ');
}

export function banner(shot: ShotDetail): HTMLElement[] {
  const title = el('div', {class: 'title'}, el('h2', {}, shot.name), el('code', {class: 'path'}, shot.folder),
      shot.until && el('span', {class: 'tag'}, 'until ' + shot.until),
      shot.has_report && el('a', {href: api.out(shot.id, 'report.html'), target: '_blank', class: 'button'}, 'Report'));
  const parts = [title, el('p', {class: 'headline'}, headline(shot)), bar(shot.counts)];
  if (shot.error) parts.push(el('p', {class: 'error', role: 'alert'}, shot.error));
  return parts;
}

function card(stage: Stage, selected: boolean, onSelect: (kind: string) => void): HTMLElement {
  const total = totalOf(stage.counts);
  const finished = finishedOf(stage.counts);
  const busy = countOf(stage.counts, runningGroup) > 0;
  const kind = ['stage', selected ? 'selected' : '', total === 0 ? 'empty' : '', busy ? 'busy' : ''].join(' ');
  return el('button', {class: kind, 'aria-pressed': selected ? 'true' : 'false', title: stage.publishes, onclick: () => onSelect(selected ? '' : stage.kind)},
      el('span', {class: 'name'}, stage.kind),
      el('span', {class: 'figure'}, total ? `${finished}/${total}` : '–'),
      bar(stage.counts),
      total ? legend(stage.counts) : el('span', {class: 'legend'}, 'nothing planned yet'),
      el('span', {class: 'cost'}, stage.wall_ms ? duration(stage.wall_ms) + ' of work' : ''));
}

export const stageCards = (shot: ShotDetail, selected: string, onSelect: (kind: string) => void) =>
    shot.stages.map(stage => card(stage, stage.kind === selected, onSelect));
