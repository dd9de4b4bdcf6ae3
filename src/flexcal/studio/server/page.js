"use strict";
// What flexcal adds to viser's page, before any of it runs.
{
  const nonce = document.currentScript.nonce;

  // viser sends at most one message of all fields and buttons of a panel in 50 ms, the last: a number that was typed is lost where another
  // field or a button follows within that time, or while a busy page is late. What is of another element is sent first instead.
  const throttle = /(\w+)=(\w+),(\w+)\?\((\w+)\.sendMessage\(\2\),(\w+)=!1,\3=!1,\w+=setTimeout\(/;
  const losesNothing = (program) => {
    if (!throttle.test(program)) {
      document.body.textContent = "The studio cannot use this version of viser, which loses numbers: pip install 'flexcal[studio]'.";
      throw new Error(document.body.textContent);
    }
    return program.replace(
      throttle,
      (all, latest, message, _ready, socket, waits) =>
        `${waits}&&${latest}&&(${latest}.uuid!==${message}.uuid||${latest}.type!==${message}.type)&&` +
        `(${socket}.sendMessage(${latest}),${waits}=!1),${all}`,
    );
  };

  // viser's page unpacks its program into a script element that it creates: scripts that a script creates are trusted as it is.
  const make = document.createElement;
  document.createElement = function (...given) {
    const made = make.apply(this, given);
    if (made instanceof HTMLScriptElement) {
      made.nonce = nonce;
      Object.defineProperty(made, "textContent", {
        set(code) {
          this.text = this.type === "module" ? losesNothing(code) : code;
        },
      });
    }
    return made;
  };

  // A number field of viser that is left without a number keeps its last one without showing it: it is shown again.
  const numbers = new WeakMap();
  const isNumber = ({ value }) => value.trim() !== "" && Number.isFinite(Number(value));
  const keep = ({ target }) => {
    if (target.matches("input.mantine-NumberInput-input") && isNumber(target)) numbers.set(target, target.value);
  };
  addEventListener("focusin", keep, true);
  addEventListener("input", keep, true);
  addEventListener("focusout", ({ target }) => {
    if (!numbers.has(target) || isNumber(target)) return;
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(target, numbers.get(target));
    target.dispatchEvent(new Event("input", { bubbles: true }));
  }, true);

  // The fields of <form data-entry> travel with its button, in one request to enter/…, with what was to be entered when the first of them was
  // typed (data-of, anywhere in the page). They cannot be changed until the answer is there, and are empty then if they were taken.
  const asked = () => document.querySelector("[data-of]")?.dataset.of ?? "";
  addEventListener("input", ({ target }) => {
    if (target.form?.matches("[data-entry]")) target.form.dataset.begun ??= asked();
  }, true);
  addEventListener("submit", async (event) => {
    const form = event.target;
    if (!form.matches("[data-entry]")) return;
    event.preventDefault();
    const fields = form.querySelector("fieldset");
    if (fields.disabled) return;
    const typed = { ...Object.fromEntries(new FormData(form)), of: form.dataset.begun ?? asked(), once: `${Math.random()}` };
    const focused = document.activeElement;
    fields.disabled = true;
    try {
      const answer = await fetch(`enter/${encodeURIComponent(JSON.stringify(typed))}`);
      if (answer.ok) form.reset();
    } finally {
      delete form.dataset.begun;
      fields.disabled = false;
      (focused.matches("input") ? form.querySelector("input") : focused).focus();
    }
  }, true);
}
