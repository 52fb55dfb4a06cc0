"""What a page is told and what it may ask: by real programs, and edges of the simulator's trace."""

import json
import re
import signal

from lab import WebTest, free_port, main

FAR = 200_000  # 80 s: under way until something ends it


def by(motor, steps):
    return {"kind": 1, "motors": [{"motor": motor, "in_steps": True, "steps": steps}]}


class WebPage(WebTest):
    def assert_stands_where_the_trace_ends(self, page, *names):
        page.take_until(lambda: not any(page.motors[name]["moving"] for name in names))
        told = {name: page.motors[name]["position_steps"] for name in names}
        self.end_programs()
        traced = self.traced_positions()
        self.assertEqual({name: traced[name] for name in names}, told)

    def test_without_a_token_sees_everything_and_may_stop(self):
        self.bring_up_web()
        page = self.open_page()
        self.assertEqual((page.hello["may_command"], page.hello["may_stop"], page.hello["user"]), (False, True, None))
        page.take_until(lambda: "a0" in page.motors and "a0" in page.descriptions and page.buses)
        self.assertTrue(page.daemons["bushd"]["connected"])

        refused = page.result(page.ask("move", **by("a0", 10)))
        self.assertEqual(refused["phase"], "refused")
        self.assertIn("bushctl web-token", refused["reason"])
        read = page.result(page.ask("get table", table="bushd2-constant"))
        self.assertEqual(read["detail"]["table"]["name"], "bushd2-constant")

        self.start_move("a0", str(FAR))
        page.take_until(lambda: page.motors["a0"]["moving"])
        self.assertEqual(page.result(page.ask("stop"))["outcome"], "done")
        self.assert_stands_where_the_trace_ends(page, "a0")

    def test_with_a_token_moves_motors_in_its_name(self):
        self.bring_up_web(kept=True)
        page = self.open_page(self.make_token("anna"))
        self.assertEqual((page.hello["may_command"], page.hello["user"]), (True, "anna"))
        page.take_until(lambda: "a0" in page.motors and "b1" in page.motors)
        number = page.ask("move", kind=1, motors=[{"motor": name, "in_steps": True, "steps": steps}
                                                  for name, steps in (("a0", 300), ("b1", -70))])
        self.assertEqual(page.answer(number)["phase"], "accepted")
        result = page.result(number)
        self.assertEqual((result["outcome"], [motor["position_steps"] for motor in result["detail"]["motors"]]), ("reached", [300, -70]))
        history = page.result(page.ask("get history", motor="a0"))["detail"]["history"]["motions"]
        self.assertRegex(history[0]["who"], " of web:anna@")
        self.end_programs()
        traced = self.traced_positions()
        self.assertEqual((traced["a0"], traced["b1"]), (300, -70))

    def test_a_jog_ends_with_the_page_that_keeps_it_going(self):
        self.bring_up_web()
        token = self.make_token()
        for how in ("closed", "silent", "frozen server"):
            with self.subTest(how):
                page = self.open_page(token)
                watcher = self.open_page()
                watcher.take_until(lambda: "a0" in watcher.motors)
                self.assertEqual(page.answer(page.ask("jog", motor="a0", speed=400, speed_in_steps=True, keepalive_ms=400))["phase"],
                                 "accepted")
                watcher.take_until(lambda: watcher.motors["a0"]["moving"])
                if how == "closed":
                    page.socket.close()
                elif how == "frozen server":
                    self.web.send(signal.SIGSTOP)
                    self.wait_until("a0 to rest", lambda: not self.motors()["a0"]["moving"])
                    self.web.send(signal.SIGCONT)
                watcher.take_until(lambda: not watcher.motors["a0"]["moving"])
        self.assert_stands_where_the_trace_ends(watcher, "a0")

    def test_is_told_of_a_daemon_that_ends_and_comes_back(self):
        self.bring_up_web()
        page = self.open_page(self.make_token())
        page.take_until(lambda: "a0" in page.motors)
        number = page.ask("move", **by("a0", FAR))
        page.take_until(lambda: page.motors["a0"]["moving"])
        self.bushd.end(signal.SIGKILL)
        lost = page.result(number)
        self.assertEqual(lost["phase"], "refused")
        self.assertIn("the daemon has ended", lost["reason"])
        page.take_until(lambda: not page.daemons["bushd"]["connected"])
        self.assertIn("bushd", page.daemons["bushd"]["why"])
        refused = page.result(page.ask("move", **by("a0", 1)))
        self.assertIn("bushd has ended", refused["reason"])
        page.motors.clear()
        self.bushd = self.start_bushd(moves="moves-2.jsonl")
        page.take_until(lambda: page.daemons["bushd"]["connected"] and "a0" in page.motors and page.mcus["hall:1"]["state"] == "READY")
        result = page.result(page.ask("move", **by("a0", 5)))
        self.assertEqual(result["outcome"], "reached")
        self.end_programs()
        self.assertEqual(self.traced_positions()["a0"], result["detail"]["motors"][0]["position_steps"])

    def test_a_table_is_checked_before_it_is_stored(self):
        self.bring_up_web()
        page = self.open_page()
        table = page.result(page.ask("get table", table="bushd2-constant"))["detail"]["table"]
        self.assertEqual(page.result(page.say("check", table=table))["outcome"], "done")
        table["accel"][3] = 5 * table["accel"][3]
        found = page.result(page.say("check", table=table))["detail"]["diagnostics"]
        self.assertTrue(any(one["side"] == "accel" for one in found), found)
        wrong = page.result(page.say("check", table=table | {"time_unit_ns": "soon"}))
        self.assertEqual((wrong["phase"], wrong["reason"]), ("refused", "time_unit_ns: a whole number in its range is expected"))

    def test_shows_what_the_doctor_finds(self):
        self.bring_up_web()
        page = self.open_page()
        findings = page.result(page.say("doctor", daemon="bushd"))["detail"]["findings"]
        self.assertIn("daemon", {finding["check"] for finding in findings})

    def test_shows_a_daemon_as_another_page_shows_it(self):
        self.bring_up_web()
        there, there_port = self.web, self.port
        self.start_web("--remote", f"hutch=http://127.0.0.1:{there_port}", log="here.log")
        hutch = self.open_page(self.make_token(), daemon="hutch")
        self.assertEqual(hutch.hello["daemons"], ["bushd", "hutch"])
        hutch.take_until(lambda: "a0" in hutch.motors and "a0" in hutch.descriptions and hutch.buses)
        self.start_move("a0", "300")
        hutch.take_until(lambda: hutch.motors["a0"]["position_steps"] == 300 and not hutch.motors["a0"]["moving"])
        refused = hutch.result(hutch.ask("stop"))
        self.assertEqual(refused["phase"], "refused")
        self.assertIn("open the page there", refused["reason"])
        there.end()
        hutch.take_until(lambda: not hutch.daemons["hutch"]["connected"])
        self.assertIn(f"http://127.0.0.1:{there_port}", hutch.daemons["hutch"]["why"])
        self.assertTrue(hutch.daemons["bushd"]["connected"])

    def test_a_far_page_that_is_away_keeps_nobody_out(self):
        nobody = free_port()
        self.bring_up_web("--remote", f"hutch=http://localhost:{nobody}")
        watcher = self.open_page(daemon="hutch")
        # Attempts are two seconds apart, and it says ten times a second that it is there: three of them.
        statuses = []
        while len(statuses) < 60:
            if watcher.take()["kind"] == "alive":
                statuses.append(self.http("GET", "/metrics")[0])
        self.assertEqual(set(statuses), {200})
        self.open_page()

    def test_programs_read_state_and_metrics(self):
        self.bring_up_web()
        page = self.open_page()
        page.take_until(lambda: page.descriptions and page.buses)
        status, headers, body = self.http("GET", "/api/state")
        self.assertEqual((status, headers["content-type"]), (200, "application/json"))
        self.assertEqual({motor["name"] for motor in json.loads(body)["motors"]}, set(page.motors))
        status, headers, body = self.http("GET", "/metrics")
        self.assertEqual(status, 200)
        self.assertIn("openmetrics-text", headers["content-type"])
        self.assertIn('bushd_motor_position_steps{daemon="bushd",mcu="hall:1",motor="a0"} 0\n', body)
        self.assertIn('bushd_motor_trust{daemon="bushd",mcu="hall:1",motor="a0",bushd_motor_trust="known"} 1\n', body)
        self.wait_until("the daemon to tell what it takes", lambda: re.search(
            r'bushd_daemon_cpu_seconds_total\{daemon="bushd"\} 0\.\d+\n', self.http("GET", "/metrics")[2]))
        self.assertTrue(body.endswith("# EOF\n"))
        self.bushd.send(signal.SIGSTOP)
        self.wait_until("it to be old", lambda: self.http("GET", "/api/state")[0] == 503)
        self.assertIn('bushd_up{daemon="bushd"} 0\n', self.http("GET", "/metrics")[2])
        self.bushd.send(signal.SIGCONT)


if __name__ == "__main__":
    main()
