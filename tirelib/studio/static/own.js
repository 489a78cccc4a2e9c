// Effects of the user's own: how one is written, which are in use, and what the last check has found.
import { app, listen, wish } from "./data.js";
import { dialog, h, toast } from "./dom.js";

const lastCheck = () => app.home?.jobs.filter((job) => job.kind === "effects").at(-1);
// A message of the check without the paths of the session, which the page does not show.
const plain = (message) => message.replaceAll(/\S*\/effects\//g, "");
export const exampleFile = () => h("a", { href: "/my_effect.py", download: "my_effect.py" }, "my_effect.py");
const failure = (job) => [h("p", { class: "bad said" }, `The check has refused the file. ${plain(job.message)}`), h("p", {}, "Mend the file and drop it again; the example ", exampleFile(), " shows how one is written.")];

// What the card tells; it is drawn again when this changes.
export const ownKey = () => [app.home?.own_effects, lastCheck()?.job, lastCheck()?.state];

export function ownEffects() {
  const job = lastCheck(), used = app.home.own_effects, code = h("pre", { class: "scroll" });
  const example = h("details", { ontoggle: async () => { code.textContent ||= await (await fetch("/my_effect.py")).text(); } }, h("summary", {}, "What is in it"), code);
  return h("div", { class: "card", id: "own" }, h("h2", {}, "Effects of your own"),
    h("p", {}, "An effect is a Python function of a dozen lines. Save the example ", exampleFile(), ", which says what a law may read and change, write your own law into it, and drop it anywhere on this page. It is shown, and run only after you have confirmed it; the check plants it and finds it again, then it joins the list of suspects."), example,
    job && ["waiting", "running"].includes(job.state) ? h("p", { role: "status" }, "A file is being checked.") : job?.state === "failed" ? failure(job) : null,
    used.length ? h("p", {}, `In use: ${used.join(", ")}`) : h("p", { class: "quiet" }, "None is in use yet."));
}

// The file that was dropped, to be read before it is run; the dialog stays until the check has ended.
export function confirmEffect(effect) {
  const place = h("div", { role: "status" }), button = h("button", { class: "main", type: "button", onclick: () => check() }, "I have read it: run and check it");
  let stop = () => {};
  const box = dialog(`Effect file ${effect.name}`,
    h("p", { class: "warn" }, "This file is a program. If you go on, it is run on this machine with your rights. It has not been run yet. Read it, and go on only if you trust where it comes from."),
    h("pre", { class: "scroll" }, effect.code), button, place);
  box.addEventListener("close", () => stop(), { once: true });
  const check = async () => {
    const done = await wish({ do: "confirm-effect", name: effect.name, sha256: effect.sha256 });
    if (!done) return;
    button.disabled = true;
    place.replaceChildren(h("p", {}, "The effect is being checked: it is planted, and must be found again. You may close this; step 5 tells what became of it."));
    const look = () => {
      const job = app.home.jobs.find((one) => one.job === done.job);
      if (job?.state === "failed") { stop(); place.replaceChildren(...failure(job)); place.scrollIntoView({ block: "nearest" }); }
      if (job?.state === "done") { stop(); box.close(); toast("The effect has passed the check and is in the list of suspects."); }
    };
    stop = listen((what) => { if (what === "state") look(); });
  };
}
