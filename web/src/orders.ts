// Buttons that change something: first what it would do, then whether to.
import {api, type OrderResult, type Target, type Verb} from './api';
import {byId, el} from './dom';

const shownNames = 12;

/// Says something for a while at the bottom of the page.
export function say(text: string, bad = false) {
  const note = byId('note');
  note.textContent = text;
  note.className = bad ? 'bad' : '';
  note.hidden = false;
  setTimeout(() => { if (note.textContent === text) note.hidden = true; }, 6000);
}

function names(result: OrderResult): HTMLElement {
  const more = result.num_changed - Math.min(result.affected.length, shownNames);
  return el('ul', {class: 'mono'}, ...result.affected.slice(0, shownNames).map(name => el('li', {}, name)),
      more > 0 && el('li', {}, `and ${more.toLocaleString('en')} more`));
}

function ask(result: OrderResult): Promise<boolean> {
  const dialog = byId('ask') as HTMLDialogElement;
  return new Promise(resolve => {
    const done = (yes: boolean) => { resolve(yes); dialog.close(); };
    dialog.onclose = () => resolve(false);
    dialog.replaceChildren(el('p', {}, result.text), names(result), el('div', {class: 'answers'},
        el('button', {class: 'quiet', onclick: () => done(false)}, 'Leave it'),
        el('button', {class: 'button', disabled: result.num_changed === 0, onclick: () => done(true)}, 'Do it')));
    dialog.showModal();
  });
}

async function carryOut(target: Target, verb: Verb) {
  try {
    if (await ask(await api.order(target, verb, true))) say((await api.order(target, verb, false)).text);
  } catch (error) {
    say(error instanceof Error ? error.message : String(error), true);
  }
}

export const orderButton = (text: string, target: Target, verb: Verb) =>
    el('button', {class: 'order', onclick: () => void carryOut(target, verb)}, text);
