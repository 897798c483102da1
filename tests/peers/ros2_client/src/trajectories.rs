//! control_msgs/action/FollowJointTrajectory: the first position of a goal says what becomes of it, and is the feedback;
//! /points has the point of each goal.

use ros2_client::{Message, MessageTypeName, Publisher};
use serde::{Deserialize, Serialize};

use crate::{name, reliable, scripted::Script, Peer};

#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Time {
    pub sec: i32,
    pub nanosec: u32,
}

#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Header {
    pub stamp: Time,
    pub frame_id: String,
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct Point {
    positions: Vec<f64>,
    velocities: Vec<f64>,
    accelerations: Vec<f64>,
    effort: Vec<f64>,
    time_from_start: Time,
}

/// Transforms have three numbers and a quaternion, twists twice three numbers.
#[derive(Clone, Default, Serialize, Deserialize)]
struct MultiPoint {
    transforms: Vec<[f64; 7]>,
    velocities: Vec<[f64; 6]>,
    accelerations: Vec<[f64; 6]>,
    time_from_start: Time,
}

#[derive(Clone, Serialize, Deserialize)]
struct Trajectory<P> {
    header: Header,
    joint_names: Vec<String>,
    points: Vec<P>,
}

#[derive(Clone, Serialize, Deserialize)]
struct Tolerance {
    name: String,
    limits: [f64; 3],
}

#[derive(Clone, Serialize, Deserialize)]
struct ComponentTolerance {
    joint_name: String,
    component: u16,
    limits: [f64; 3],
}

#[derive(Clone, Serialize, Deserialize)]
pub struct Goal {
    trajectory: Trajectory<Point>,
    multi_dof_trajectory: Trajectory<MultiPoint>,
    path_tolerance: Vec<Tolerance>,
    component_path_tolerance: Vec<ComponentTolerance>,
    goal_tolerance: Vec<Tolerance>,
    component_goal_tolerance: Vec<ComponentTolerance>,
    goal_time_tolerance: Time,
}

#[derive(Clone, Serialize, Deserialize)]
pub struct Outcome {
    error_code: i32,
    error_string: String,
}

#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Feedback {
    header: Header,
    joint_names: Vec<String>,
    desired: Point,
    actual: Point,
    error: Point,
    multi_dof_joint_names: Vec<String>,
    multi_dof_desired: MultiPoint,
    multi_dof_actual: MultiPoint,
    multi_dof_error: MultiPoint,
}

impl Message for Point {}
impl Message for Goal {}
impl Message for Outcome {}
impl Message for Feedback {}

pub struct Trajectories(Publisher<Point>);

impl Trajectories {
    pub fn new(peer: &mut Peer) -> Trajectories {
        let kind = MessageTypeName::new("trajectory_msgs", "JointTrajectoryPoint");
        let topic = peer.node.create_topic(&name("/points"), kind, &reliable());
        let topic = topic.expect("a topic");
        Trajectories(peer.node.create_publisher(&topic, None).expect("/points"))
    }
}

impl Script for Trajectories {
    type Goal = Goal;
    type Outcome = Outcome;
    type Feedback = Feedback;

    const ACTION: [&'static str; 3] = ["/gantry", "control_msgs", "FollowJointTrajectory"];

    fn number(goal: &Goal) -> f64 {
        goal.trajectory.points[0].positions[0]
    }

    fn fields(goal: &Goal) -> String {
        goal.trajectory.joint_names.join(" ")
    }

    fn feedback(goal: &Goal) -> Feedback {
        let mut feedback = Feedback::default();
        feedback.actual.positions = vec![Self::number(goal)];
        feedback
    }

    fn outcome(number: f64) -> Outcome {
        Outcome {
            error_code: if number == 11.0 { -5 } else { 0 },
            error_string: "ü".into(),
        }
    }

    fn take(&self, goal: &Goal) {
        let published = self.0.publish(goal.trajectory.points[0].clone());
        assert!(published.is_ok(), "a point");
    }
}
