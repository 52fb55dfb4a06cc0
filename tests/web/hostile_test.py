"""What no page would send, and pages that do not read: others feel nothing, and bushd-web goes on."""

import random
import socket

from lab import OpenPage, WebTest, main
from websocket import BINARY, TEXT, Ended, Refused, WebSocket

SEED = 39


class WebHostile(WebTest):
    def assert_nothing_moves(self):
        self.assertEqual({position for position in self.positions().values()}, {0})
        self.assertFalse(any(motor["moving"] for motor in self.motors().values()))

    def assert_serves(self):
        page = self.open_page()
        page.take_until(lambda: "a0" in page.motors)
        self.assertTrue(self.web.lives())
        page.socket.close()

    def test_messages_that_are_none_are_refused_and_nothing_else_happens(self):
        self.bring_up_web()
        page = self.open_page(self.make_token())
        page.take_until(lambda: "a0" in page.motors)
        texts = ["", "null", "[]", "{}", "x", "{\"kind\":\"ask\"}", "[" * 100_000, "{\"id\":1e400}", "{\"id\":-1,\"kind\":\"ask\"}", "\"\ud83d\"",
                 "{\"id\":5,\"kind\":\"ask\",\"daemon\":\"bushd\",\"request\":\"move\",\"fields\":{\"kind\":9}}",
                 "{\"id\":5,\"kind\":\"ask\",\"daemon\":\"bushd\",\"request\":\"move\",\"fields\":{\"motors\":[1]}}",
                 "{\"id\":5,\"kind\":\"ask\",\"daemon\":\"bushd\",\"request\":\"stop\",\"fields\":{\"motors\":[\"a\\u0000b\"]}}",
                 "{\"id\":5,\"kind\":\"ask\",\"daemon\":\"nobody\",\"request\":\"stop\"}", "{\"id\":5,\"kind\":\"doctor\",\"daemon\":\"nobody\"}",
                 "{\"id\":5,\"kind\":\"ask\",\"daemon\":\"bushd\",\"request\":\"camac\"}"]
        for text in texts:
            before = len(page.replies)
            page.socket.send_frame(TEXT, text.encode("utf-8", errors="surrogatepass"))
            page.take_until(lambda: len(page.replies) > before)
            self.assertEqual(page.replies[-1]["phase"], "refused", text[:80])
            self.assertTrue(page.replies[-1]["reason"])
        self.assert_nothing_moves()
        self.assert_serves()

    def test_a_message_cut_and_changed_at_random_is_never_a_move_of_another_motor(self):
        self.bring_up_web()
        random.seed(SEED)
        print(f"seed {SEED}")
        page = self.open_page()  # it may only look: whatever it says, nothing may move
        good = b'{"kind":"ask","id":1,"daemon":"bushd","request":"move","fields":{"kind":1,"motors":[{"motor":"a0","in_steps":true,"steps":9}]}}'
        for _ in range(200):
            changed = bytearray(good)
            for _ in range(random.randrange(4)):
                changed[random.randrange(len(changed))] = random.randrange(256)
            del changed[random.randrange(len(changed)):random.choice((0, len(changed)))]
            before = len(page.replies)
            page.socket.send_frame(TEXT, bytes(changed))
            page.take_until(lambda: len(page.replies) > before)
            self.assertEqual(page.replies[-1]["phase"], "refused")
        self.assert_nothing_moves()

    def test_what_is_too_large_or_no_text_ends_the_page_that_sends_it(self):
        self.bring_up_web()
        for send in (lambda web: web.send_frame(TEXT, b" " * 10_000_000), lambda web: web.send_frame(BINARY, b"{}")):
            page = self.open_page()
            try:
                send(page.socket)
                with self.assertRaises(Ended):
                    page.take_until(lambda: False)
            except (BrokenPipeError, ConnectionResetError):
                pass  # it was closed while it was sent
            self.assert_serves()

    def test_a_flood_of_messages_is_refused_and_stops_are_taken(self):
        self.bring_up_web()
        self.start_move("a0", "200000")
        page = self.open_page()
        page.take_until(lambda: "a0" in page.motors and page.motors["a0"]["moving"])
        for _ in range(2000):
            page.ask("list tables")
        stopped = page.result(page.ask("stop"))
        self.assertEqual(stopped["outcome"], "done")
        self.assertTrue(any("too many messages" in reply["reason"] for reply in page.replies))
        self.assertFalse(self.motors()["a0"]["moving"])

    def test_sixty_pages_and_one_that_does_not_read(self):
        self.bring_up_web()
        deaf = WebSocket(self.port)
        self.addCleanup(deaf.close)
        pages = [self.open_page() for _ in range(60)]
        self.start_move("a0", "300")
        for page in pages:
            page.take_until(lambda page=page: page.motors.get("a0", {}).get("position_steps") == 300)

    def test_a_thousand_connections_keep_nobody_out_for_long(self):
        self.bring_up_web()
        watcher = self.open_page()
        watcher.take_until(lambda: "a0" in watcher.motors)
        silent = []
        for _ in range(1000):
            one = socket.socket()
            one.setblocking(False)
            one.connect_ex(("127.0.0.1", self.port))
            silent.append(one)
            self.addCleanup(one.close)
        self.start_move("a0", "300")
        watcher.take_until(lambda: watcher.motors["a0"]["position_steps"] == 300)

        def opens():
            try:
                page = OpenPage(WebSocket(self.port, timeout_s=5))
            except (Ended, Refused, OSError):
                return False
            page.socket.close()
            return True

        self.wait_until("a new page to be served", opens)


if __name__ == "__main__":
    main()
