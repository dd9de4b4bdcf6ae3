"use strict";
// What flexcal adds to viser's page, before any of it runs.
{
  const nonce = document.currentScript.nonce;

  // viser sends at most one message of all fields and buttons of a panel in 50 ms, the last: a number that was typed is lost where another
  // field or a button follows within that time, or while a busy page is late. What is of another element is sent first instead. A hot key
  // and a link are sent at once: what waits is sent before them.
  const late = new Map();
  const sendLate = () => {
    late.forEach((send) => send());
    late.clear();
  };
  globalThis.flexcalStudio = { late, sendLate };
  const throttle =
    /function (\w+)\((\w+)\)\{let (\w+)=(\w+\.mutable\.current);\3\.sendMessage!==null&&\((\w+)=\2,(\w+)\?\(\3\.sendMessage\(\2\),(\w+)=!1,\6=!1,(\w+=setTimeout\([^;{}]*\{[^{}]*\},\w+\))\):\7=!0\)\}/;
  const hotkey = /sendMessage\((\{type:`CommandTriggerMessage`,uuid:\w+\})\)/;
  const losesNothing = (program) => {
    if (!throttle.test(program) || !hotkey.test(program)) {
      document.body.textContent = "The studio cannot use this version of viser, which loses numbers: pip install 'flexcal[studio]'.";
      throw new Error(document.body.textContent);
    }
    return program
      .replace(
        throttle,
        (_, send, message, socket, current, latest, ready, waits, timer) =>
          `function ${send}(${message}){let ${socket}=${current};if(${socket}.sendMessage===null)return;` +
          `${waits}&&${latest}&&(${latest}.uuid!==${message}.uuid||${latest}.type!==${message}.type)&&` +
          `(${socket}.sendMessage(${latest}),${waits}=!1);${latest}=${message};` +
          `if(${ready}){${socket}.sendMessage(${message});${waits}=!1;${ready}=!1;${timer}}` +
          `else{${waits}=!0;flexcalStudio.late.set(${send},()=>{${waits}&&${latest}&&(${socket}.sendMessage(${latest}),${waits}=!1)})}}`,
      )
      .replace(hotkey, (_, message) => `sendMessage((flexcalStudio.sendLate(),${message}))`);
  };
  addEventListener("click", ({ target }) => {
    if (target instanceof Element && target.closest("a")) sendLate();
  }, true);

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

  // viser's camera moves by W, A, S, D, Q, E and the arrows, and listens at the document: letters are hot keys here, and arrows move the
  // slider or list that has the focus. What has come as far as the root element has been seen by all others.
  document.documentElement.addEventListener("keydown", (event) => {
    const isCamera = event.target instanceof HTMLCanvasElement || event.target === document.body;
    if (/^Key/.test(event.code) || (/^Arrow/.test(event.code) && !isCamera)) event.stopPropagation();
  });

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
  // typed (data-of, anywhere in the page). They cannot be changed until the answer is there, and are empty then if they were taken. What is
  // typed and not taken yet is in the form again when the page is built anew: after another step, in another layout, after a reload.
  const asked = () => document.querySelector("[data-of]")?.dataset.of ?? "";
  const draft = {
    key: `typed ${location.pathname}`,
    get: () => JSON.parse(sessionStorage.getItem(draft.key) ?? "null"),
    put: (typed) => sessionStorage.setItem(draft.key, JSON.stringify(typed)),
    drop: () => sessionStorage.removeItem(draft.key),
  };
  const fieldsOf = (form) => [...form.querySelectorAll("input[name]")];
  addEventListener("input", ({ target }) => {
    const form = target.form;
    if (!form?.matches("[data-entry]")) return;
    const texts = Object.fromEntries(new FormData(form));
    if (Object.values(texts).some((text) => text !== "")) draft.put({ texts, of: draft.get()?.of ?? asked() });
    else draft.drop();
  }, true);
  new MutationObserver((changes) => {
    if (!changes.some(({ addedNodes }) => addedNodes.length > 0)) return;
    for (const form of document.querySelectorAll("form[data-entry]:not([data-filled])")) {
      form.dataset.filled = "";
      const texts = draft.get()?.texts ?? {};
      for (const field of fieldsOf(form)) field.value = texts[field.name] ?? "";
    }
  }).observe(document, { childList: true, subtree: true });
  addEventListener("submit", async (event) => {
    const form = event.target;
    if (!form.matches("[data-entry]")) return;
    event.preventDefault();
    if ("sent" in form.dataset) return;
    const fields = fieldsOf(form);
    const typed = { ...Object.fromEntries(new FormData(form)), of: draft.get()?.of ?? asked(), once: `${Math.random()}` };
    const focused = document.activeElement;
    form.dataset.sent = "";
    for (const field of fields) field.readOnly = true; // it keeps the focus: the next digit must not become a hot key
    sendLate();
    try {
      const answer = await fetch(`enter/${encodeURIComponent(JSON.stringify(typed))}`);
      if (answer.ok) {
        form.reset();
        draft.drop();
      } else if (draft.get()) {
        draft.put({ texts: draft.get().texts });
      }
    } finally {
      delete form.dataset.sent;
      for (const field of fields) field.readOnly = false;
      if (focused?.matches("input")) fields[0].focus();
    }
  }, true);
}
