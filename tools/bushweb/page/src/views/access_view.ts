// Who may: a page reads until somebody enters a token.
import type { App, View } from "../ui/app";
import { button, el, field, put, section, show } from "../ui/dom";

export class AccessView implements View {
  readonly title = "Access";
  readonly root: HTMLElement;
  private readonly state = el("p", { testid: "access-state" });
  private readonly said = el("p", { class: "said error-text", role: "alert" });
  private readonly token = field("Token", {
    type: "password", testid: "token", autocomplete: "off", spellcheck: "false",
  });
  private readonly login: HTMLElement;
  private readonly logout: HTMLButtonElement;

  constructor(private readonly app: App) {
    const enter = el("button", { type: "submit", text: "Use this token", testid: "login" });
    this.login = el(
      "div", {},
      el("p", {}, "A member of the group bushd makes one with ", el("code", { text: "bushctl web-token" }),
        ". It is entered once; the browser keeps a cookie that scripts cannot read."),
      el("form", {
        class: "fields",
        on: { submit: (event: Event) => { event.preventDefault(); void this.enter(); } },
      }, this.token.root, enter), this.said,
    );
    this.logout = button("Forget the token in this browser", () => void this.leave(), { testid: "logout" });
    this.root = el("div", {}, el("h1", { text: "Access" }),
      section("Rights of this page", this.state, this.login, this.logout));
    this.update();
  }

  update(): void {
    const hello = this.app.model.hello;
    if (!hello) {
      put(this.state, "There is no connection to bushd-web.");
    } else if (hello.may_command) {
      put(this.state, `This page may command${hello.user ? `, as ${hello.user}` : ""}.`);
    } else {
      put(this.state, hello.may_stop
        ? "This page may read, and stop motors. To move them it needs a token."
        : "This page may only read. To move and to stop motors it needs a token.");
    }
    show(this.login, hello?.may_command !== true);
    show(this.logout, hello?.user != null);
  }

  tick(): void {}

  close(): void {}

  private async enter(): Promise<void> {
    const token = this.token.input.value.trim();
    if (token === "") {
      put(this.said, "Type or paste the token first");
      return;
    }
    const answer = await post("api/login", { token });
    put(this.said, answer);
    if (answer !== "") return;
    this.token.input.value = "";
    this.app.connection.reconnect();
  }

  private async leave(): Promise<void> {
    put(this.said, await post("api/logout", {}));
    this.app.connection.reconnect();
  }
}

// "": it went well.
async function post(path: string, body: object): Promise<string> {
  try {
    const response = await fetch(path, {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body),
      credentials: "same-origin",
    });
    if (response.ok) return "";
    if (response.status === 429) return "Too many attempts. Wait a minute";
    const told = (await response.json().catch(() => ({}))) as { error?: string };
    return told.error ?? `bushd-web answered ${response.status}`;
  } catch {
    return "There is no connection to bushd-web";
  }
}
