// As much of Unity as an exported package uses, with its meaning: a scene without a picture.
using System;
using System.Collections.Generic;
using System.IO;
using System.Reflection;

namespace UnityEngine.Rendering { public enum IndexFormat { UInt16, UInt32 } }

namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float a, float b, float c) { x = a; y = b; z = c; }
        public static Vector3 zero { get { return new Vector3(0, 0, 0); } }
        public static Vector3 one { get { return new Vector3(1, 1, 1); } }
        public float magnitude { get { return (float)Math.Sqrt(x * x + y * y + z * z); } }
        public static Vector3 operator +(Vector3 a, Vector3 b) { return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z); }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3(a.x - b.x, a.y - b.y, a.z - b.z); }
        public static Vector3 operator *(Vector3 a, float s) { return new Vector3(s * a.x, s * a.y, s * a.z); }
        public static Vector3 Lerp(Vector3 a, Vector3 b, float t) { return a + (b - a) * t; }
    }

    public struct Quaternion
    {
        public float x, y, z, w;
        public Quaternion(float a, float b, float c, float d) { x = a; y = b; z = c; w = d; }
        public static Quaternion identity { get { return new Quaternion(0, 0, 0, 1); } }
        public static Quaternion Inverse(Quaternion q) { return new Quaternion(-q.x, -q.y, -q.z, q.w); }
        public static Vector3 operator *(Quaternion q, Vector3 v)
        {
            float a = 2 * (q.y * v.z - q.z * v.y), b = 2 * (q.z * v.x - q.x * v.z), c = 2 * (q.x * v.y - q.y * v.x);
            return new Vector3(v.x + q.w * a + q.y * c - q.z * b, v.y + q.w * b + q.z * a - q.x * c,
                v.z + q.w * c + q.x * b - q.y * a);
        }
    }

    public static class Mathf
    {
        public const float PI = 3.14159274f;
        public static float Abs(float v) { return Math.Abs(v); }
        public static float Cos(float v) { return (float)Math.Cos(v); }
    }

    public static class Time { public static float time, fixedDeltaTime = 0.001f; }
    public static class Debug
    {
        public static readonly List<string> Warnings = new List<string>();
        public static void LogWarning(object message, Object context) { Warnings.Add(message.ToString()); }
    }

    public class Object
    {
        public string name;
        public static void Destroy(Object thing) { }
    }

    public sealed class TextAsset : Object { public byte[] bytes; }
    public static class Resources
    {
        public static T Load<T>(string name) where T : class
        {
            string path = Path.Combine(Environment.GetEnvironmentVariable("RESOURCES"), name + ".bytes");
            return File.Exists(path) ? new TextAsset { bytes = File.ReadAllBytes(path) } as T : null;
        }
    }

    public sealed class Mesh : Object
    {
        public Rendering.IndexFormat indexFormat;
        public Vector3[] vertices;
        public int[] triangles;
        public void MarkDynamic() { }
        public void RecalculateNormals() { }
        public void RecalculateBounds() { }
    }

    public class Component : Object
    {
        public GameObject gameObject;
        public Transform transform { get { return gameObject.transform; } }
        public T GetComponent<T>() where T : Component { return gameObject.GetComponent<T>(); }
    }

    public sealed class Transform : Component
    {
        public Vector3 position, localScale = Vector3.one;
        public Quaternion rotation = Quaternion.identity;
        public Vector3 lossyScale { get { return localScale; } }
    }

    public class Collider : Component { }
    public sealed class Material : Object { }
    public sealed class MeshFilter : Component { public Mesh sharedMesh; }
    public sealed class MeshRenderer : Component { public Material sharedMaterial; }
    public sealed class Rigidbody : Component
    {
        public Vector3 pushed;
        public Vector3 turned, at;
        public void AddForce(Vector3 force) { pushed = force; }
        public void AddForceAtPosition(Vector3 force, Vector3 place) { pushed = force; at = place; }
        public void AddTorque(Vector3 torque) { turned = torque; }
    }
    public class MonoBehaviour : Component { }

    public enum PrimitiveType { Sphere }

    public sealed class GameObject : Object
    {
        public readonly Transform transform = new Transform();
        public static readonly List<GameObject> All = new List<GameObject>();
        readonly List<Component> parts = new List<Component>();
        bool active = true;
        public GameObject(string named) { name = named; transform.gameObject = this; All.Add(this); }
        public static GameObject CreatePrimitive(PrimitiveType kind)
        {
            var made = new GameObject(kind.ToString());
            made.AddComponent<Collider>();
            made.AddComponent<MeshRenderer>().sharedMaterial = new Material();
            return made;
        }
        public T GetComponent<T>() where T : Component
        {
            if (typeof(T) == typeof(Transform)) return transform as T;
            foreach (var part in parts) if (part is T) return (T)part;
            return null;
        }
        Component Add(Type kind)
        {
            foreach (RequireComponent need in kind.GetCustomAttributes(typeof(RequireComponent), false))
                foreach (var other in new[] { need.First, need.Second }) Add(other);
            var part = (Component)Activator.CreateInstance(kind);
            part.gameObject = this;
            part.name = name;
            parts.Add(part);
            if (active) Call(part, "OnEnable");
            return part;
        }
        public T AddComponent<T>() where T : Component { return (T)Add(typeof(T)); }
        public void SetActive(bool now)
        {
            active = now;
            foreach (var part in parts.ToArray()) Call(part, now ? "OnEnable" : "OnDisable");
        }
        static void Call(Component part, string method)
        {
            var found = part.GetType().GetMethod(method, BindingFlags.Instance | BindingFlags.NonPublic);
            if (found != null) found.Invoke(part, null);
        }
        public static void Send(string method)
        {
            foreach (var thing in All.ToArray())
                if (thing.active) foreach (var part in thing.parts.ToArray()) Call(part, method);
        }
    }

    public struct Rect { public Rect(float x, float y, float w, float h) { } }
    public static class GUI { public static string Shown; public static void Label(Rect r, string text) { Shown = text; } }

    public sealed class AddComponentMenu : Attribute { public AddComponentMenu(string path) { } }
    public sealed class TooltipAttribute : Attribute { public TooltipAttribute(string text) { } }
    public sealed class RequireComponent : Attribute
    {
        public readonly Type First, Second;
        public RequireComponent(Type a, Type b) { First = a; Second = b; }
    }
}
