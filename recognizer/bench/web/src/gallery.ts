/** All objects with their pictures, to search and choose from by mouse or keys. */

import { get } from "./api";
import { element, say } from "./dom";
import type { ObjectEntry } from "./types";

const LEAST = 3; // letters of a word that is looked for beside the name: "2" means a name, not 124 symbols

interface Item { name: string; words: string[]; item: HTMLLIElement; button: HTMLButtonElement }

export class Gallery {
  private readonly dialog = element<HTMLDialogElement>("gallery");
  private readonly search = element<HTMLInputElement>("gallery-search");
  private readonly list = element("gallery-list");
  private items: Item[] = [];

  constructor(private readonly chosen: (object: string) => void, private readonly shown: () => string) {
    element("gallery-open").addEventListener("click", () => void this.open().catch(() => undefined));
    this.search.addEventListener("input", () => this.filter());
    this.dialog.addEventListener("keydown", (event) => this.key(event));
  }

  private async open(): Promise<void> {
    const { objects } = await get<{ objects: ObjectEntry[] }>("objects");
    this.items = objects.map((one) => this.itemOf(one));
    this.list.replaceChildren(...this.items.map(({ item }) => item));
    this.search.value = "";
    this.filter();
    this.dialog.showModal();
    this.search.focus();
    this.list.querySelector('[aria-current="true"]')?.scrollIntoView({ block: "nearest" });
  }

  private itemOf(one: ObjectEntry): Item {
    const item = document.createElement("li"), button = document.createElement("button");
    const picture = document.createElement("img"), name = document.createElement("strong"), more = document.createElement("span");
    picture.loading = "lazy";
    picture.alt = "";
    picture.src = `/api/objects/${encodeURIComponent(one.name)}/picture.svg?at=${encodeURIComponent(one.registered)}`;
    name.textContent = one.name;
    more.className = "muted";
    more.textContent = `${one.type}, ${one.faces} faces, ${one.symbols} symbols${one.retired ? ", retired" : ""}`;
    button.type = "button";
    button.setAttribute("aria-current", String(one.name === this.shown()));
    button.append(picture, name, more);
    button.addEventListener("click", () => {
      this.dialog.close();
      this.chosen(one.name);
    });
    item.append(button);
    const words = `${more.textContent} ${one.profile} ${one.registered}`.toLowerCase().split(/[\s,_]+/);
    return { name: one.name.toLowerCase(), words, item, button };
  }

  /** Show the objects of which all words are true. */
  private filter(): void {
    const wanted = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let found = 0;
    for (const { name, words, item } of this.items) {
      item.hidden = !wanted.every((word) => name.includes(word) || (word.length >= LEAST && words.some((one) => one.startsWith(word))));
      found += item.hidden ? 0 : 1;
    }
    say(element("gallery-count"), `${found} of ${this.items.length} objects`);
  }

  /** Arrow keys go through what is shown, Enter in the search takes the first. */
  private key(event: KeyboardEvent): void {
    if (event.key === "Escape") { // a search field would only be emptied
      event.preventDefault();
      this.dialog.close();
      return;
    }
    const shown = this.items.filter(({ item }) => !item.hidden).map(({ button }) => button);
    const at = shown.indexOf(document.activeElement as HTMLButtonElement);
    const across = Math.max(1, shown.filter((one) => one.offsetTop === shown[0]?.offsetTop).length);
    const steps: Record<string, number> = { ArrowRight: 1, ArrowLeft: -1, ArrowDown: across, ArrowUp: -across };
    const step = steps[event.key];
    if (event.key === "Enter" && at < 0 && document.activeElement === this.search) {
      event.preventDefault();
      shown[0]?.click();
      return;
    }
    if (event.key === "Home" && at >= 0) shown[0]?.focus();
    else if (event.key === "End" && at >= 0) shown.at(-1)?.focus();
    else if (step === undefined || (at < 0 && event.key !== "ArrowDown")) return;
    else if (at < 0) shown[0]?.focus();
    else if (at + step < 0) this.search.focus();
    else shown[Math.min(shown.length - 1, at + step)]?.focus();
    event.preventDefault();
  }
}
