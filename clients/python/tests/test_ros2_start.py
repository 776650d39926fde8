"""How the node of the ROS 2 bridge starts and ends, with stand-ins for ROS: parameters, launch files, the end."""
import contextlib
import importlib.util
import io
import math
import sys
import unittest
from unittest import mock

from ros_stand_ins import BRIDGE, ExternalShutdown, Message, Ros, launch_modules

from sonard_bridge.parameters import PARAMETERS, BadParameter, checked


class Parameters(unittest.TestCase):
    @staticmethod
    def given(**parameters):
        return {**{p.name: p.default for p in PARAMETERS}, **parameters}

    def test_values_with_types_of_yaml_are_accepted(self):
        values = checked(self.given(odometry="/odom", vehicle=1, tf_rate_hz=50, truth_rate_hz="1e1", http="10.0.0.1"))
        self.assertEqual((values["vehicle"], values["tf_rate_hz"], values["truth_rate_hz"]), ("1", 50.0, 10.0))
        self.assertEqual((values["sonard"], values["http"]), (("127.0.0.1", 14771), ("10.0.0.1", 8088)))
        self.assertTrue(checked(self.given(tf_static=True)))  # no source is needed for frames of sonard

    def test_wrong_parameters_are_named(self):
        for name, parameters in (("odometry", {}), ("pose", {"odometry": "/a", "pose": "/b"}), ("tf_child", {"tf_parent": "map"}),
                                 ("tf_parent", {"tf_child": "base_link"}), ("vehicle", {"vehicle": True}),
                                 ("vehicle", {"vehicle": 1e3}),
                                 ("tf_rate_hz", {"tf_rate_hz": 0.0}), ("tf_rate_hz", {"tf_rate_hz": "fast"}),
                                 ("tf_rate_hz", {"tf_rate_hz": True}), ("truth_rate_hz", {"truth_rate_hz": -1}),
                                 ("truth_rate_hz", {"truth_rate_hz": math.inf}), ("cloud_threshold", {"cloud_threshold": 2}),
                                 ("use_stamps", {"use_stamps": "yes"}), ("sonard", {"sonard": "127.0.0.1:x"}),
                                 ("http", {"http": "127.0.0.1:99999"}), ("token_file", {"token_file": "/nowhere/token"})):
            source = {} if name in ("odometry", "pose", "tf_child", "tf_parent") else {"odometry": "/odom"}
            full = self.given(**source, **parameters)
            with self.subTest(**parameters), self.assertRaisesRegex(BadParameter, f"^parameter {name}: .") as raised:
                checked(full)
            self.assertEqual(raised.exception.name, name)

    def test_the_readme_has_a_line_for_each_parameter(self):
        text = (BRIDGE / "README.md").read_text(encoding="utf-8")
        self.assertEqual([p.name for p in PARAMETERS if f"`{p.name}`" not in text], [])


class TheEnd(unittest.TestCase):
    def end(self, spin=None, **parameters):
        ros = Ros(**parameters)
        def default(node):
            raise ExternalShutdown
        ros.spin = spin or default
        errors = io.StringIO()
        with ros.module() as module, contextlib.redirect_stderr(errors):
            code = module.main()
        self.assertEqual(ros.shut_down, 1)
        return code, errors.getvalue()

    def test_signals_end_the_node_silently(self):
        def interrupt(node):
            raise KeyboardInterrupt
        for spin in (None, interrupt):
            self.assertEqual(self.end(spin, odometry="/odom"), (0, ""))

    def test_an_early_wake_is_corrected_with_a_steady_clock(self):
        ros = Ros(odometry="/odom", use_sim_time=True)

        def spin(node):
            self.assertLessEqual(ros.steady_timers[0][0], 1)
            ros.steady_timers[0][1]()
            raise ExternalShutdown
        ros.spin = spin
        with ros.module() as module:
            self.assertEqual(module.main(), 0)

    def test_errors_of_rclpy_after_the_end_are_ignored(self):
        for is_ok in (False, True):
            ros = Ros(odometry="/odom")

            def spin(node, ros=ros, is_ok=is_ok):
                ros.is_ok = is_ok
                raise RuntimeError("the context is invalid")
            ros.spin = spin
            with ros.module() as module:
                if is_ok:
                    self.assertRaises(RuntimeError, module.main)
                else:
                    self.assertEqual(module.main(), 0)
            self.assertEqual(ros.shut_down, 1)

    def test_a_wrong_parameter_is_one_sentence(self):
        for parameters, words in (({}, "parameter odometry: nothing to do"),
                                  ({"odometry": "/odom", "tf_rate_hz": 0.0}, "parameter tf_rate_hz: 0 is not"),
                                  ({"odometry": "/odom", "sonard": "no-such-host.invalid"}, "parameter sonard: no-such-host")):
            with self.subTest(**parameters):
                code, errors = self.end(**parameters)
                self.assertEqual((code, errors.count("\n")), (2, 1))
                self.assertIn(words, errors)
                self.assertNotIn("Traceback", errors)

    def test_parameters_cannot_be_set_later(self):
        ros = Ros(odometry="/odom")
        with ros.module() as module:
            module.Bridge().close()
        self.assertEqual(list(ros.declared), [p.name for p in PARAMETERS])
        for _, descriptor in ros.declared.values():
            self.assertTrue(descriptor.read_only and descriptor.dynamic_typing and descriptor.description)


class Launch(unittest.TestCase):
    def setUp(self):
        patch = mock.patch.dict(sys.modules, launch_modules())
        patch.start()
        self.addCleanup(patch.stop)
        sys.modules.pop("sonard_bridge.launching", None)
        self.addCleanup(sys.modules.pop, "sonard_bridge.launching", None)

    @staticmethod
    def description(name):
        spec = importlib.util.spec_from_file_location("described", BRIDGE / "launch" / name)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module.generate_launch_description().arguments[0]

    @staticmethod
    def of(kind, actions):
        return [action for action in actions if type(action).__name__ == kind]

    def test_every_parameter_is_an_argument_and_texts_stay_text(self):
        actions = self.description("bridge.launch.py")
        declared = {a.arguments[0]: a.named for a in self.of("DeclareLaunchArgument", actions)}
        self.assertEqual(list(declared), [p.name for p in PARAMETERS] + ["use_sim_time", "namespace"])
        self.assertEqual((declared["use_stamps"]["default_value"], declared["tf_rate_hz"]["default_value"]), ("true", "50.0"))
        node, = self.of("Node", actions)
        (given,) = node.named["parameters"]
        self.assertEqual(set(given), {p.name for p in PARAMETERS} | {"use_sim_time"})
        for parameter in PARAMETERS:
            value = given[parameter.name]
            is_text = isinstance(parameter.default, str)
            self.assertEqual(type(value).__name__, "ParameterValue" if is_text else "LaunchConfiguration", parameter.name)
            self.assertEqual(value.named, {"value_type": str} if is_text else {}, parameter.name)

    def started(self, **given):
        actions = self.description("sonard.launch.py")
        names = {a.arguments[0]: a.named["default_value"] for a in self.of("DeclareLaunchArgument", actions)}
        start, = self.of("OpaqueFunction", actions)
        return start.named["function"]({**names, **given})

    def test_the_others_wait_for_sonard(self):
        handler, sonard = self.started(config="dive.yaml", options="--clock stepped", driver="ros2 launch 'my driver' x.py",
                                       autopilot="sim_vehicle.py -v ArduSub")
        self.assertEqual(sonard.named["cmd"], ["sonard", "run", "dive.yaml", "--clock", "stepped"])
        self.assertEqual(type(sonard.named["on_exit"]).__name__, "Shutdown")
        hear = handler.arguments[0].named
        self.assertIs(hear["target_action"], sonard)
        self.assertEqual(hear["on_stdout"](Message(text=b"sonard 0.1.0\nrea")), [])
        bridge, autopilot, driver = hear["on_stdout"](Message(text=b"dy in 0.21 s."))
        self.assertEqual(type(bridge).__name__, "Node")
        self.assertEqual(autopilot.named["cmd"], ["sim_vehicle.py", "-v", "ArduSub"])
        self.assertEqual(driver.named["cmd"], ["ros2", "launch", "my driver", "x.py"])
        self.assertEqual(hear["on_stderr"](Message(text=b"ready in 1 s.")), [])  # once

    def test_the_demo_starts_without_a_driver(self):
        handler, sonard = self.started()
        self.assertEqual(sonard.named["cmd"], ["sonard", "run", "--demo"])
        self.assertEqual(len(handler.arguments[0].named["on_stdout"](Message(text=b"ready in 1 s."))), 1)


if __name__ == "__main__":
    unittest.main()
