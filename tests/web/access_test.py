"""Who may what, by what a browser says of itself."""

import json
import socket

from lab import WebTest, main
from websocket import Ended, Refused


class WebAccess(WebTest):
    def test_a_page_of_somebody_else_gets_nothing(self):
        self.bring_up_web()
        here = f"127.0.0.1:{self.port}"
        for options in ({"origin": "http://evil.example"}, {"origin": "null"}, {"origin": f"http://{here}.evil.example"},
                        {"host": "evil.example"}, {"host": f"evil.example:{self.port}", "origin": f"http://evil.example:{self.port}"},
                        {"path": "/api/other"}, {"protocol": None}, {"protocol": "another"}):
            with self.subTest(options), self.assertRaises((Refused, Ended)):
                self.open_page(**options)
        for options in ({"origin": f"http://{here}"}, {"host": f"localhost:{self.port}", "origin": f"http://localhost:{self.port}"}):
            self.assertTrue(self.open_page(**options).hello["may_stop"])
        self.assertEqual(self.http("GET", "/", Host="evil.example")[0], 421)
        self.assertEqual(self.http("GET", "/metrics", Host=f"evil.example:{self.port}")[0], 421)
        self.assertEqual(self.http("POST", "/api/login", json.dumps({"token": "x"}), Origin="http://evil.example")[0], 403)

    def test_the_page_runs_nothing_but_its_own_files(self):
        self.bring_up_web()
        status, headers, body = self.http("GET", "/")
        self.assertEqual((status, "a page" in body), (200, True))
        self.assertIn("script-src 'self'", headers["content-security-policy"])
        self.assertEqual(headers["x-content-type-options"], "nosniff")
        self.assertNotIn("access-control-allow-origin", headers)
        for path in ("/../tokens", "/%2e%2e/tokens", "/index.html.gz", "//etc/passwd"):
            self.assertEqual(self.http("GET", path)[0], 404, path)
        self.assertEqual(self.http("PUT", "/", "x")[0], 405)

    def test_a_token_gives_the_right_to_command_until_it_is_revoked(self):
        self.bring_up_web()
        token = self.make_token("anna")
        status, headers, _ = self.http("POST", "/api/login", json.dumps({"token": token.upper().replace("-", " ")}))
        self.assertEqual(status, 200)
        self.assertRegex(headers["set-cookie"], r"^bushd_web=[0-9a-zA-Z]{32}; Path=/; HttpOnly; SameSite=Strict; Max-Age=\d+$")
        self.assertNotIn(token, self.file("tokens").read_text())
        page = self.open_page(token)
        self.assertTrue(page.hello["may_command"])
        self.command("web-token", "--revoke", "anna", "--file", self.file("tokens"))
        page.take_until(lambda: not page.hello["may_command"])
        self.assertFalse(self.open_page(cookie=headers["set-cookie"].partition(";")[0]).hello["may_command"])

    def test_who_logs_out_commands_from_no_tab_any_more(self):
        self.bring_up_web()
        cookie = self.log_in(self.make_token())
        tabs = [self.open_page(cookie=cookie) for _ in range(2)]
        other = self.open_page(self.make_token("bert"))
        self.assertEqual(self.http("POST", "/api/logout", "{}", Cookie=cookie)[0], 200)
        for tab in tabs:
            tab.take_until(lambda tab=tab: not tab.hello["may_command"])
        self.assertTrue(other.hello["may_command"])

    def test_one_request_has_one_answer(self):
        self.bring_up_web()
        with socket.create_connection(("127.0.0.1", self.port), timeout=30) as raw:
            raw.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4\r\n\r\nabcd")
            answer = b""
            while part := raw.recv(65536):
                answer += part
        self.assertEqual(answer.count(b"HTTP/1.1 "), 1)
        self.assertTrue(answer.startswith(b"HTTP/1.1 405"), answer[:40])

    def test_wrong_tokens_are_refused_and_soon_not_even_tried(self):
        self.bring_up_web()
        good = self.make_token()
        wrong = "a" * 32
        statuses = [self.http("POST", "/api/login", json.dumps({"token": wrong}))[0] for _ in range(12)]
        self.assertEqual(statuses[:10], [403] * 10)
        # One more is taken each ten seconds.
        self.assertIn(429, statuses[10:])
        self.assertEqual(self.http("POST", "/api/login", json.dumps({"token": good}))[0], 200)
        for body in ("", "{}", "[]", "{\"token\": 7}", "x" * 4096):
            self.assertIn(self.http("POST", "/api/login", body)[0], (400, 429))
        self.assertFalse(self.open_page(cookie=f"bushd_web={wrong}").hello["may_command"])

    def test_who_may_stop_without_a_token_is_configured(self):
        self.bring_up_web("--stop-without-token", "nobody")
        page = self.open_page()
        self.assertFalse(page.hello["may_stop"])
        refused = page.result(page.ask("emergency stop"))
        self.assertEqual(refused["phase"], "refused")
        self.assertIn("may not stop", refused["reason"])
        self.assertEqual(self.mcu_states(), ["READY", "READY"])
        self.web.end()
        self.start_web("--behind-proxy", log="behind-proxy.log")
        self.assertFalse(self.open_page().hello["may_stop"])

    def test_beyond_this_pc_it_needs_tls(self):
        import subprocess

        from rig import program

        for arguments, reason in ((["--listen", "0.0.0.0:8260"], "--tls-cert"), (["--listen", "here"], "ADDRESS:PORT"),
                                  (["--daemon", "x"], "NAME=SOCKET"), (["--tls-cert", "x"], "belong together")):
            ended = subprocess.run([program("BUSHD_WEB"), *arguments], capture_output=True, text=True, timeout=60)
            self.assertEqual((ended.returncode, reason in ended.stderr), (2, True), ended.stderr)


if __name__ == "__main__":
    main()
