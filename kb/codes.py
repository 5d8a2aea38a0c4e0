"""The codes of problems: what each means, and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass

from kb.problems import Severity


@dataclass(frozen=True, slots=True, kw_only=True)
class Code:
    """What is wrong wherever a code stands, and what helps; Markdown."""

    meaning: str
    advice: str
    severity: Severity = Severity.ERROR


CODES: dict[str, Code] = {
    "KB001": Code(
        meaning="A file cannot be read, does not parse as RDF/XML, or has not exactly one ontology IRI.",
        advice="In Protégé, *File > Save as > RDF/XML Syntax*; in an editor, go to the line.",
    ),
    "KB002": Code(
        meaning="An import has no file in the folder.",
        advice="Add the file, or correct the IRI of the import. Nothing is fetched from the network.",
    ),
    "KB003": Code(
        meaning="Two files have the ontology IRI of an import.",
        advice="Give one of them another IRI, or remove it.",
    ),
    "KB004": Code(
        meaning="Two entities have the same name behind `#`.",
        advice="Rename one: code, commands and traces use the name alone.",
    ),
    "KB005": Code(
        meaning="A file is larger than 50 MB.",
        advice="Put data into files of their own; the message tells the size.",
    ),
    "KB006": Code(
        meaning="An import is a place, such as `package://...` or `file:///...`, and not the IRI of an ontology.",
        advice="Import the IRI that the file itself states.",
    ),
    "KB007": Code(
        meaning="A file is no RDF/XML, but Turtle, OWL/XML or something else.",
        advice="In Protégé, *File > Save as > RDF/XML Syntax*.",
    ),
    "KB008": Code(
        meaning="A file declares an XML entity that is more than an abbreviation.",
        advice="Write out what it stands for where it is used.",
    ),
    "KB009": Code(
        meaning="An entity is called `true`, `false`, `null`, `none` or `here`, which are something else in plans.",
        advice="Rename it: *Refactor > Rename entity* in Protégé.",
    ),
    "KB010": Code(
        meaning="An ontology file of the folder is imported by no site: nothing that it says holds.",
        advice="Import it where it is needed, or move it away.",
        severity=Severity.WARNING,
    ),
    "KB011": Code(
        meaning="A term is used that is declared nowhere, by its name or by what stands before the `#`.",
        advice="Correct the spelling, or declare the term.",
    ),
    "KB012": Code(
        meaning="A value is no value of its datatype, or not a finite number, or the datatype is not known.",
        advice=(
            "Use `xsd:string`, `xsd:boolean`, `xsd:integer`, `xsd:double` (with a point; not `NaN` or `INF`) or "
            "`xsd:anyURI`. In Protégé, choose the datatype: a number such as 7.5 is `xsd:decimal` there if nothing is "
            "chosen."
        ),
    ),
    "KB013": Code(
        meaning="A deprecated term is used.",
        advice="Use the term that its `replacedBy` names.",
        severity=Severity.WARNING,
    ),
    "KB014": Code(
        meaning="A class restriction `some`, `only` or with a number names an individual for a class.",
        advice="In Protégé: `property value individual`; or name the class of the individual.",
    ),
    "KB015": Code(
        meaning=(
            "A property of individuals has a literal, a class or something without a name for a value, or a property "
            "of literals an individual."
        ),
        advice="Name an individual, or give a literal with a datatype.",
    ),
    "KB016": Code(
        meaning=(
            "An individual is used as what it is not: its classes are not the domain or range of a property; or a"
            " literal has another datatype than the property. A reasoner would take the individual for one, too, "
            "and no shape would check it."
        ),
        advice="Give the individual its class, another property, or the literal the datatype.",
    ),
    "KB017": Code(
        meaning="An individual has no class.",
        advice="In Protégé, *Types*: add the class.",
    ),
    "KB018": Code(
        meaning="An entity has two labels in one language.",
        advice="Keep one: screens show one of them, nobody knows which.",
        severity=Severity.WARNING,
    ),
    "KB101": Code(
        meaning="An atomic process has no grounding, or several.",
        advice=(
            "Give it one `RobotGrounding`, `ComputeGrounding`, `ActionGrounding` or `TopicGrounding` that `grounds` it."
        ),
    ),
    "KB103": Code(
        meaning="A composite process has no `composedOf`, or several.",
        advice="Name the one control construct that it consists of.",
    ),
    "KB104": Code(
        meaning="A parameter has no `parameterType`, or several.",
        advice="Name the class of its values.",
    ),
    "KB105": Code(
        meaning="A parameter has no usable `parameterName`.",
        advice="Letters, digits and `_`, the first a small letter.",
    ),
    "KB106": Code(
        meaning="A `Perform` performs no process, or several.",
        advice="Name one: an `AtomicProcess`, a `CompositeProcess` or a `SimpleProcess`.",
    ),
    "KB107": Code(
        meaning="A control construct lacks a step, or is of no known kind.",
        advice="Give it the step that its class needs: `hasStep`, `bodyStep` or `thenStep`.",
    ),
    "KB108": Code(
        meaning="Two steps of a sequence, or of what is prioritized, have the same `stepNumber`.",
        advice="Renumber one.",
    ),
    "KB109": Code(
        meaning="A step of a sequence, or of what is prioritized, has no `stepNumber`.",
        advice="Number it, in steps of ten.",
    ),
    "KB110": Code(
        meaning="An input of a performed process has no value.",
        advice="Give the enclosing process a parameter of that name, or the step a `Binding`.",
    ),
    "KB111": Code(
        meaning="A process has two parameters of one name.",
        advice="Rename one.",
    ),
    "KB112": Code(
        meaning="A parameter is given a value of another class.",
        advice="Bind another one, or change the `parameterType`.",
    ),
    "KB114": Code(
        meaning="A parameter belongs to several processes.",
        advice="Give each process its own.",
    ),
    "KB115": Code(
        meaning="A construct that needs a condition has none, or several.",
        advice="Give it one `hasCondition`; join several with `AllOf` or `AnyOf`.",
    ),
    "KB116": Code(
        meaning="`ForEach` or `Pick` does not say over what; or `Pick` has several.",
        advice="Give it `overParameter`; nest another `Pick` for the next.",
    ),
    "KB117": Code(
        meaning="A binding lacks one of its two ends, or binds what is no parameter of the performed process.",
        advice="Correct `toParameter` and `fromParameter`.",
    ),
    "KB118": Code(
        meaning="A condition `Holds` or `IsTrue` is not whole.",
        advice=(
            "`Holds`: `ofProperty`, `subjectParameter` and either `objectParameter` or `hasValue`. `IsTrue`: "
            "`ofTruthValue`."
        ),
    ),
    "KB119": Code(
        meaning="A condition has the wrong number of operands.",
        advice="`AllOf` and `AnyOf` take one or more, `Not` takes one.",
    ),
    "KB120": Code(
        meaning="A grounding is not whole.",
        advice="One `grounds`, one `timeout_s` above 0, and one `serviceName` if it is a service.",
    ),
    "KB121": Code(
        meaning="A field of a request or reply is not whole.",
        advice="One `fieldName`, one `messageType`, and either `mapsParameter` or `fileName`.",
    ),
    "KB122": Code(
        meaning="A grounding does not fit the process that it grounds.",
        advice="Every output comes from a reply field; fields map parameters of that process.",
    ),
    "KB123": Code(
        meaning="An effect is not whole.",
        advice="`ofProperty`, `subjectParameter` and either `objectParameter` or `hasValue`.",
    ),
    "KB124": Code(
        meaning="A parameter is used in a process that it does not belong to.",
        advice="Add it to the process, or use one of the process.",
    ),
    "KB125": Code(
        meaning="A file that a service reads does not exist.",
        advice="Put it into the folder of the site, or correct `fileName`.",
    ),
    "KB126": Code(
        meaning="A local that is an individual is used where it has no value.",
        advice="Put what uses it into a `ForEach`, `Pick` or `Interrupt` with that `overParameter`.",
    ),
    "KB127": Code(
        meaning="A condition `Compare` is not whole.",
        advice=(
            "`comparison` (less, at most, more, at least or equal), `ofProperty`, `subjectParameter`, and either "
            "`hasValue` (a number) or `objectProperty` and `objectParameter`."
        ),
    ),
    "KB128": Code(
        meaning="A process claims what it is not given.",
        advice="`claimsParameter` names an input that is an individual: no message, no robot, no local.",
    ),
    "KB129": Code(
        meaning="A process realizes a task type that it does not fit.",
        advice=(
            "Its inputs are found by name among those of the task type and take all that those may be given; it "
            "has the outputs that the task type promises."
        ),
    ),
    "KB130": Code(
        meaning="A task type (`SimpleProcess`) has no recipe.",
        advice="Let a process `realizes` it.",
    ),
    "KB131": Code(
        meaning="A robot does not state what a service needs to know of it.",
        advice="Give its class `SubClassOf: property value ...`.",
    ),
    "KB132": Code(
        meaning="A robot's `radius_m`, `maxVelLin_mps`, `maxVelAng_radps`, `energy_J` or `power_W` is not above 0.",
        advice="Correct the value, of the robot or of its class.",
    ),
    "KB133": Code(
        meaning="A robot has `energy_J` or `power_W` without the other.",
        advice="Give both or none: it can work for energy over power, in seconds.",
    ),
    "KB134": Code(
        meaning="A `capacity` is not a whole number above 0.",
        advice="Correct it, of the resource or of its class; without one, it is 1.",
    ),
    "KB135": Code(
        meaning="A service is told the class of a thing, but its file has no entry for that class.",
        advice="Add an entry to the file, such as `HUE.yaml`, or give the thing another class.",
    ),
    "KB136": Code(
        meaning="A grounding in a ROS action does not say in which.",
        advice="One `actionName` such as `/{robot}/navigate_to_pose`, one `actionType`: `nav2_msgs/NavigateToPose`.",
    ),
    "KB137": Code(
        meaning="A grounding in a ROS topic is not whole.",
        advice=(
            "One `topicName` such as `/{robot}/scan`, one `maxAge_s` above 0, no request field, and one reply field "
            "whose `messageType` is that of the topic."
        ),
    ),
    "KB140": Code(
        meaning="A location is in no area.",
        advice="Give it `inArea`.",
    ),
    "KB141": Code(
        meaning="A location has no whole pose, or a tolerance that is none.",
        advice="`poseX_m`, `poseY_m` and `poseYaw_rad`, each one xsd:double; a `tolerance_m` is 0 or more.",
    ),
    "KB143": Code(
        meaning="A property that has one value at most has several.",
        advice="Remove all but one.",
    ),
    "KB144": Code(
        meaning="A condition or effect states a value that its property cannot have.",
        advice="Give `hasValue` the datatype of the property; for a property of individuals, use `objectParameter`.",
    ),
    "KB145": Code(
        meaning="An effect changes a property that is no fluent: nobody would see the change.",
        advice="Mark the property `fluent true`, or change another one.",
    ),
    "KB146": Code(
        meaning="A `failureCode` is not whole, or two classes of failure claim it.",
        advice=(
            "The ROS type that defines it (or `concertmaster`), its number if it has one, and its name, each parted by "
            "a space; of one class."
        ),
    ),
    "KB147": Code(
        meaning="A recovery does not say what it costs, or not in a way that can be.",
        advice=(
            "`recoveryTime_s` 0 or more, `recoveryOdds` above 0 and at most 1; `maxAttempts`, if any, 1 or more; "
            "`pause_s`, if any, at most `recoveryTime_s`."
        ),
    ),
    "KB148": Code(
        meaning="`recoveredBy` names what is no recovery, or `expectedFailure` what is no class of failure.",
        advice="The one names an individual of a class below `Recovery`, the other a class below `Failure`.",
    ),
    "KB160": Code(
        meaning="An atomic process does not say how long it takes.",
        advice="One `duration_s`; 0.0 where it takes no time worth planning with.",
    ),
    "KB161": Code(
        meaning="A travel duration is not whole, or has another robot travel than the first.",
        advice=(
            "`travelingRobot`, the robot parameter with the smallest `parameterNumber`; `travelGoal`; and a "
            "`serviceName`."
        ),
    ),
    "KB162": Code(
        meaning="Two travel durations name different services or fields.",
        advice="Only one way to estimate travel is supported: give all the same `serviceName` and fields.",
    ),
    "KB163": Code(
        meaning="A `duration_s` or `graceTime_s` is negative, or no number, or longer than any plan may be.",
        advice="xsd:double, 0 or more, at most 1e8 (three years).",
    ),
    "KB164": Code(
        meaning="`successOdds` are not above 0 and at most 1, or of a process that is not one step.",
        advice="Give them to an atomic process, or to one with a `hasDurationModel`.",
    ),
    "KB165": Code(
        meaning="A `Deadline` does not say when.",
        advice="One `deadline_s`, xsd:double, 0.001 or more, at most 1e8.",
    ),
    "KB166": Code(
        meaning="A learned value is of the wrong sort.",
        advice="`learnedDuration_s` is 0 or more, `learnedOdds` and `learnedRecoveryOdds` are above 0 and at most 1, "
        "`learnedTravelFactor` is above 0.",
    ),
    "KB167": Code(
        meaning="A `LearnedValue` does not say of what it is, or another says the same.",
        advice="One `ofProcess` that is one step, one `ofRobot`, at most one `atPlace`, and a learned number.",
    ),
    "KB203": Code(
        meaning="A rule has an atom that nothing can be made of, such as an unsupported built-in.",
        advice="The message says which, and what there is instead.",
    ),
    "KB204": Code(
        meaning="A variable of a rule gets no value.",
        advice="Give it a class or property atom, or name it like a parameter of the process.",
    ),
    "KB205": Code(
        meaning="A variable of a rule is named nearly like a parameter, or no variable of the rule is named like one.",
        advice="Name it like the parameter that is meant.",
        severity=Severity.WARNING,
    ),
    "KB206": Code(
        meaning="A `RuleCondition` has no rule, or only rules that are switched off.",
        advice="Write a rule with the head `satisfied(Condition, true)`.",
    ),
    "KB207": Code(
        meaning="A rule concludes something else than `satisfied(Condition, true)`.",
        advice="Say it with classes and properties, or make it a condition.",
    ),
    "KB210": Code(
        meaning=(
            "A process performs itself, directly or through others, and either cannot end or comes back to itself"
            " before a step is done."
        ),
        advice=(
            "Let a `Choice` or `IfThenElse` leave out the call, and put a step before it in a `Sequence`; or use"
            " `RepeatUntil` or `RepeatWhile`."
        ),
    ),
    "KB211": Code(
        meaning="A control construct or condition contains itself, directly or through others.",
        advice="Name another step or operand; to do something again, use `RepeatUntil` or `RepeatWhile`.",
    ),
    "KB212": Code(
        meaning=(
            "The test of a loop or interrupt asks for what nothing changes: no step of its body or beside it, and"
            " no effect."
        ),
        advice="Ask for what a step of the body finds out, or for a property that is a fluent.",
    ),
    "KB213": Code(
        meaning="The body of a loop or interrupt may do nothing: it could turn for ever in no time.",
        advice=(
            "Let its body do a step every time; the body of a `ForEach`, a `RepeatWhile` or an `Iterate` may be "
            "done no time."
        ),
    ),
    "KB214": Code(
        meaning="The preconditions of a process exclude each other.",
        advice="The message names two of them: correct one.",
    ),
    "KB215": Code(
        meaning=(
            "A step or condition reads a message that no step can have made before, or a process promises an "
            "output that no step makes."
        ),
        advice="Look at the `stepNumber`s first; then at names and `Binding`s.",
    ),
    "KB216": Code(
        meaning="A step is never come to: what is before it never ends, or its condition cannot hold there.",
        advice="Correct the condition or the order, or remove the step.",
        severity=Severity.WARNING,
    ),
    "KB217": Code(
        meaning=(
            "A process is never done: it needs a message that only another step can make, and nothing that can be"
            " asked for performs it."
        ),
        advice="Perform it, let it realize a task type, or remove it.",
        severity=Severity.WARNING,
    ),
    "KB218": Code(
        meaning="A parameter is not used.",
        advice="Remove it, or use it: bind it in a step, name it in a condition.",
        severity=Severity.WARNING,
    ),
    "KB219": Code(
        meaning="No robot of the site and no class of robots can do a process.",
        advice="The message says what each lacks: equip a robot, or correct `requiresCapability`.",
        severity=Severity.WARNING,
    ),
    "KB301": Code(
        meaning="The ontology contradicts itself.",
        advice="The message names the axioms that clash and where they stand: change one.",
    ),
    "KB302": Code(
        meaning="Nothing can ever belong to a class.",
        advice="Its axioms contradict each other: change one.",
    ),
    "KB303": Code(
        meaning="Something is not OWL 2 DL: reasoners refuse it or differ, and so may Protégé.",
        advice="The message names the axiom and what would be right.",
    ),
    "KB304": Code(
        meaning=(
            "Two names stand for one individual, stated by `owl:sameAs` or because a property can have one value only."
        ),
        advice="Use one name: all else takes two names for two things.",
    ),
}
